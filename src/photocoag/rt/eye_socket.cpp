#include "photocoag/rt/eye_socket.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "photocoag/core/descriptor.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {
namespace {

constexpr std::int64_t kMs = 1'000'000;  // ns
constexpr std::size_t kMostDescriptors = 2;

struct Address {
  sockaddr_un name{};
  socklen_t size = 0;
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&name); }
};

bool is_abstract(const std::string& path) { return path.starts_with('@'); }

Address address_of(const std::string& path) {
  Address address;
  address.name.sun_family = AF_UNIX;
  const bool abstract = is_abstract(path);
  if (path.size() <= (abstract ? 1U : 0U) || path.size() >= sizeof(address.name.sun_path)) {
    throw Error(ErrorParts{.where = "eye",
                           .problem = "the socket's path does not fit",
                           .found = path,
                           .accepted = "1 to 107 bytes; a shorter folder, or @NAME for none"});
  }
  std::memcpy(address.name.sun_path, path.c_str(), path.size() + 1);
  if (abstract) address.name.sun_path[0] = '\0';
  address.size =
      static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size() + (abstract ? 0 : 1));
  return address;
}

[[noreturn]] void refuse(const std::string& path, const char* problem, int reason,
                         const char* accepted = "") {
  throw Error(ErrorParts{
      .where = path, .problem = problem, .found = std::strerror(reason), .accepted = accepted});
}

uid_t user_behind(int socket) noexcept {
  ucred peer{};
  socklen_t size = sizeof(peer);
  const bool known = getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
  return known ? peer.uid : static_cast<uid_t>(-1);
}

int new_socket(int flags) noexcept {
  return ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | flags, 0);
}

bool is_served(const Address& address) noexcept {
  const int socket = new_socket(SOCK_NONBLOCK);
  const bool served = socket >= 0 && (connect(socket, address.get(), address.size) == 0 ||
                                      errno == EAGAIN || errno == EACCES || errno == EPERM);
  if (socket >= 0) close(socket);
  return served;
}

/// Lets one process at a time in this folder check whether a socket is served and replace it.
class FolderLock {
 public:
  explicit FolderLock(const std::string& path) {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    descriptor_ =
        Descriptor(open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    const std::int64_t give_up = monotonic_ns() + 2'000 * kMs;
    while (descriptor_.open() && flock(descriptor_.number(), LOCK_EX | LOCK_NB) != 0) {
      if (monotonic_ns() > give_up) refuse(path, "its folder is locked by another program", EBUSY);
      wait_until(monotonic_ns() + 10 * kMs);
    }
  }

 private:
  Descriptor descriptor_;
};

void remove_unserved(const std::string& path) {
  struct stat file {};
  if (lstat(path.c_str(), &file) != 0) return;
  if (!S_ISSOCK(file.st_mode)) {
    refuse(path, "a file is there that is no socket", EEXIST, "a new name, or a socket");
  }
  if (is_served(address_of(path))) {
    refuse(path, "an eye is there already", EADDRINUSE, "another socket, or the end of that eye");
  }
  unlink(path.c_str());
}

}  // namespace

int connect_to(const std::string& path, int timeout_ms) {
  const Address address = address_of(path);
  const int socket = new_socket(SOCK_NONBLOCK);
  const std::int64_t give_up = monotonic_ns() + timeout_ms * kMs;
  int reason = socket < 0 ? errno : 0;
  while (reason == 0 && connect(socket, address.get(), address.size) != 0) {
    reason = errno;
    if (reason != EAGAIN && reason != EINTR) break;
    if (monotonic_ns() > give_up) break;  // it does not take connections
    reason = 0;
    wait_until(monotonic_ns() + 10 * kMs);
  }
  if (reason == 0 && is_abstract(path) && user_behind(socket) != geteuid()) reason = EPERM;
  if (reason != 0) {
    if (socket >= 0) close(socket);
    refuse(path, reason == EAGAIN ? "the eye accepts no connection" : "no eye answers there",
           reason);
  }
  return socket;
}

Listener::Listener(const std::string& path) : path_(path) {
  const bool abstract = is_abstract(path);
  // Under another name until it listens: whoever sees the path may connect.
  const std::string part = abstract ? path : fmt::format("{}~{}", path, getpid());
  const Address address = address_of(part);
  socket_ = new_socket(SOCK_NONBLOCK);
  const auto failed = [&](const char* problem) {
    const int reason = errno;
    if (socket_ >= 0) close(socket_);
    if (!abstract) unlink(part.c_str());
    refuse(path, problem, reason);
  };
  if (socket_ < 0) failed("the socket cannot be made");
  fchmod(socket_, S_IRUSR | S_IWUSR);  // the file never has more than this
  if (bind(socket_, address.get(), address.size) != 0) failed("the socket cannot be made");
  if (!abstract && chmod(part.c_str(), S_IRUSR | S_IWUSR) != 0) failed("it cannot be made private");
  if (listen(socket_, 64) != 0) failed("the socket cannot listen");
  if (abstract) return;
  struct stat file {};
  lstat(part.c_str(), &file);
  device_ = file.st_dev;
  file_ = file.st_ino;
  try {
    const FolderLock lock(path);
    remove_unserved(path);
    if (link(part.c_str(), path.c_str()) != 0) refuse(path, "the socket has no name", errno);
  } catch (...) {
    close(socket_);
    unlink(part.c_str());
    throw;
  }
  unlink(part.c_str());
}

Listener::~Listener() {
  struct stat file {};
  const bool own = !is_abstract(path_) && lstat(path_.c_str(), &file) == 0 &&
                   file.st_dev == device_ && file.st_ino == file_;
  if (own) unlink(path_.c_str());
  close(socket_);
}

int Listener::accept() const noexcept {
  const int guest = accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
  if (guest < 0) return guest;
  const uid_t user = user_behind(guest);
  if (user == geteuid() || user == 0) return guest;
  close(guest);
  errno = EAGAIN;
  return -1;
}

bool send_message(int socket, const void* data, std::size_t size,
                  std::span<const int> descriptors) noexcept {
  iovec part{.iov_base = const_cast<void*>(data), .iov_len = size};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  alignas(cmsghdr) char control[CMSG_SPACE(kMostDescriptors * sizeof(int))] = {};
  if (const std::size_t count = std::min(descriptors.size(), kMostDescriptors); count > 0) {
    message.msg_control = control;
    message.msg_controllen = CMSG_SPACE(count * sizeof(int));
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(count * sizeof(int));
    std::memcpy(CMSG_DATA(header), descriptors.data(), count * sizeof(int));
  }
  return sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT) == static_cast<ssize_t>(size);
}

long receive_message(int socket, void* data, std::size_t size, int timeout_ms,
                     std::span<int> descriptors) noexcept {
  std::fill(descriptors.begin(), descriptors.end(), -1);
  if (timeout_ms > 0) {
    pollfd wait{.fd = socket, .events = POLLIN, .revents = 0};
    if (poll(&wait, 1, timeout_ms) <= 0) return kNoMessage;
  }
  iovec part{.iov_base = data, .iov_len = size};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  // What does not fit in here the kernel closes.
  alignas(cmsghdr) char control[CMSG_SPACE(kMostDescriptors * sizeof(int))] = {};
  message.msg_control = control;
  message.msg_controllen = sizeof(control);
  const ssize_t got = recvmsg(socket, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  if (got < 0) {
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR ? kNoMessage : 0;
  }
  std::size_t kept = 0;
  const bool too_long = (message.msg_flags & MSG_TRUNC) != 0;
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (header->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < count; ++i) {
      int received = -1;
      std::memcpy(&received, CMSG_DATA(header) + i * sizeof(int), sizeof(int));
      if (kept < descriptors.size() && !too_long) {
        descriptors[kept++] = received;
      } else {
        close(received);
      }
    }
  }
  return too_long ? kMessageTooLong : static_cast<long>(got);
}

}  // namespace photocoag
