// Role: safety tests; a low-level client of the console that can misbehave: HTTP requests,
// WebSocket frames, silence. Shares no code with the server. Used by web_rows, tests.
// Source: RFC 6455. Threads: one owner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace photocoag {

/// One masked client frame. `claimed`: a false payload length.
std::string web_frame(std::uint8_t opcode, std::string_view payload,
                      std::optional<std::uint64_t> claimed = std::nullopt, bool last = true);

class RawClient {
 public:
  /// Connects to 127.0.0.1. `receive_bytes` above 0: size of the receive buffer. Throws Error.
  explicit RawClient(std::uint16_t port, int receive_bytes = 0);
  ~RawClient();
  RawClient(RawClient&& other) noexcept;
  RawClient& operator=(RawClient&&) = delete;

  /// False: the server has closed, or accepts nothing for a second.
  bool send(std::string_view bytes) noexcept;
  /// Everything until the server closes or is silent for `silence` seconds.
  std::string read_all(double silence);
  /// True once the server has closed; data before that are discarded.
  bool closes_within(double seconds);

  struct Upgrade {
    std::string token;
    std::string origin;  ///< empty: no such header
    std::string host;    ///< empty: the right one
    std::string path = "/ws";
  };
  /// Requests the WebSocket; returns the status code, 0 if the server only closed.
  int upgrade(const Upgrade& how);
  bool say(std::string_view text) noexcept { return send(web_frame(1, text)); }
  /// The next text message; nullopt after `seconds`, or if the server closed.
  std::optional<std::string> hear(double seconds);
  /// The first message that contains `words`; nullopt after `seconds`.
  std::optional<std::string> hear_of(std::string_view words, double seconds);
  /// Code of the close frame received by hear(); 0: none.
  int close_code() const noexcept { return close_code_; }

 private:
  bool fill(double seconds);
  std::uint16_t port_;
  int socket_ = -1;
  int close_code_ = 0;
  std::string rest_;  // read and not yet used
};

}  // namespace photocoag
