#include "photocoag/rt/eye_socket.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    throw Error(ErrorParts{.where = "eye",
                           .problem = "the socket's path does not fit",
                           .found = path,
                           .accepted = "1 to 107 bytes"});
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

[[noreturn]] void refuse(int socket, const std::string& path, const char* problem) {
  const int reason = errno;
  if (socket >= 0) close(socket);
  throw Error(ErrorParts{.where = path, .problem = problem, .found = std::strerror(reason)});
}

}  // namespace

int connect_to(const std::string& path) {
  const sockaddr_un address = address_of(path);
  const int socket = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (socket < 0 ||
      connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    refuse(socket, path, "no eye answers there");
  }
  return socket;
}

int listen_on(const std::string& path) {
  // Under another name until it listens: who sees the path may connect.
  const std::string part = path + "~";
  const sockaddr_un address = address_of(part);
  const int socket = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  unlink(part.c_str());
  if (socket < 0 ||
      bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      listen(socket, 8) != 0 || std::rename(part.c_str(), path.c_str()) != 0) {
    refuse(socket, path, "the socket cannot be made");
  }
  return socket;
}

bool send_message(int socket, const void* data, std::size_t size, int descriptor) noexcept {
  iovec part{.iov_base = const_cast<void*>(data), .iov_len = size};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  if (descriptor >= 0) {
    message.msg_control = control;
    message.msg_controllen = sizeof(control);
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(header), &descriptor, sizeof(int));
  }
  return sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT) == static_cast<ssize_t>(size);
}

long receive_message(int socket, void* data, std::size_t size, int timeout_ms,
                     int* descriptor) noexcept {
  if (descriptor != nullptr) *descriptor = -1;
  if (timeout_ms > 0) {
    pollfd wait{.fd = socket, .events = POLLIN, .revents = 0};
    if (poll(&wait, 1, timeout_ms) <= 0) return -1;
  }
  iovec part{.iov_base = data, .iov_len = size};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  message.msg_control = control;
  message.msg_controllen = sizeof(control);
  const ssize_t got = recvmsg(socket, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  if (got < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR ? -1 : 0;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
    int received = -1;
    std::memcpy(&received, CMSG_DATA(header), sizeof(int));
    if (descriptor != nullptr) {
      *descriptor = received;
    } else {
      close(received);
    }
  }
  return static_cast<long>(got);
}

}  // namespace photocoag
