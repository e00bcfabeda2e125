// Role: tests of safety; a client of the console made of bytes, so that it can misbehave: HTTP
// requests, WebSocket frames, silence. Shares nothing with the server. Used by web_rows, tests.
// Source: RFC 6455. Threads: one owner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace photocoag {

/// One frame from a client, masked. `claimed`: a length that the payload does not have.
std::string web_frame(std::uint8_t opcode, std::string_view payload,
                      std::optional<std::uint64_t> claimed = std::nullopt, bool last = true);

class RawClient {
 public:
  /// To 127.0.0.1. `receive_bytes` above 0: room for so much that was not read. Throws Error.
  explicit RawClient(std::uint16_t port, int receive_bytes = 0);
  ~RawClient();
  RawClient(RawClient&& other) noexcept;
  RawClient& operator=(RawClient&&) = delete;

  /// False: the other side has closed, or takes nothing for a second.
  bool send(std::string_view bytes) noexcept;
  /// What comes until the other side closes or is silent for so many seconds.
  std::string read_all(double silence);
  /// True once the other side has closed, what comes before that is thrown away.
  bool closes_within(double seconds);

  struct Upgrade {
    std::string token;
    std::string origin;  ///< empty: no such header
    std::string host;    ///< empty: the right one
    std::string path = "/ws";
  };
  /// Asks for the WebSocket; the status code of the answer, 0 if it only closed.
  int upgrade(const Upgrade& how);
  bool say(std::string_view text) noexcept { return send(web_frame(1, text)); }
  /// The next text message; none after so many seconds, or if the other side closed.
  std::optional<std::string> hear(double seconds);
  /// The first message with these words; none in time.
  std::optional<std::string> hear_of(std::string_view words, double seconds);
  /// Code of the close frame that hear() met; 0: none.
  int close_code() const noexcept { return close_code_; }

 private:
  bool fill(double seconds);
  std::uint16_t port_;
  int socket_ = -1;
  int close_code_ = 0;
  std::string rest_;  // read and not yet used
};

}  // namespace photocoag
