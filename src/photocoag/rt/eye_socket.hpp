// Role: setup; Unix sockets that carry messages and descriptors. Used by rt and eye.
#pragma once

#include <cstddef>
#include <string>

namespace photocoag {

/// A socket (SOCK_SEQPACKET) connected to `path`. Throws Error.
int connect_to(const std::string& path);
/// A socket that listens on `path`; an old one there is replaced. Throws Error.
int listen_on(const std::string& path);
/// One message, with a descriptor unless it is negative. False if the other side is gone.
bool send_message(int socket, const void* data, std::size_t size, int descriptor = -1) noexcept;
/// One message, at most `size` bytes, within `timeout_ms`: its size; 0: closed; -1: none came.
/// `descriptor`: what came along, else -1.
long receive_message(int socket, void* data, std::size_t size, int timeout_ms,
                     int* descriptor = nullptr) noexcept;

}  // namespace photocoag
