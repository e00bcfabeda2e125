// Role: setup; Unix sockets that carry messages and descriptors. Used by rt, eye, run.
// Source: docs/devices.md, "Transports". A name that begins with @ is in the kernel (abstract) and
// leaves no file.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <span>
#include <string>

namespace photocoag {

inline constexpr long kNoMessage = -1;
inline constexpr long kMessageTooLong = -2;

/// A socket (SOCK_SEQPACKET) connected to `path` within `timeout_ms`. Throws Error; also if the
/// server of an abstract name is another user's.
int connect_to(const std::string& path, int timeout_ms = 5000);

/// A listening socket whose file has mode 0600, whatever the umask.
class Listener {
 public:
  /// Replaces a socket file only if nobody serves it. Throws Error.
  explicit Listener(const std::string& path);
  /// Removes the file if it is still its own.
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  int socket() const noexcept { return socket_; }
  /// The next connection of this user or root; negative: none. Others are closed.
  int accept() const noexcept;

 private:
  std::string path_;
  int socket_ = -1;
  dev_t device_ = 0;
  ino_t file_ = 0;
};

/// Sends one message with at most two descriptors. False if it was not sent.
bool send_message(int socket, const void* data, std::size_t size,
                  std::span<const int> descriptors = {}) noexcept;
/// One message, at most `size` bytes, within `timeout_ms`: its size; 0: closed; kNoMessage;
/// kMessageTooLong: discarded. `descriptors`: those received, -1 for the rest; any that do not fit
/// are closed.
long receive_message(int socket, void* data, std::size_t size, int timeout_ms,
                     std::span<int> descriptors = {}) noexcept;

}  // namespace photocoag
