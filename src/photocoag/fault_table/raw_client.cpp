#include "photocoag/fault_table/raw_client.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {
namespace {

void append_big_endian(std::string& to, std::uint64_t value, int bytes) {
  for (int k = bytes - 1; k >= 0; --k) to += static_cast<char>(value >> (8 * k));
}

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

/// The length of a frame's head and its payload; none: not all of the head is there.
struct FrameHead {
  std::size_t head = 0;
  std::uint64_t payload = 0;
};
std::optional<FrameHead> head_of(std::string_view bytes) {
  if (bytes.size() < 2) return {};
  const auto small = static_cast<unsigned char>(bytes[1]) & 0x7fU;
  const std::size_t extra = small == 126 ? 2 : small == 127 ? 8 : 0;
  if (bytes.size() < 2 + extra) return {};
  return FrameHead{2 + extra, extra == 0 ? small : big_endian(bytes.substr(2, extra))};
}

}  // namespace

std::string web_frame(std::uint8_t opcode, std::string_view payload,
                      std::optional<std::uint64_t> claimed, bool last) {
  constexpr std::string_view kMask = "mask";
  const std::uint64_t length = claimed.value_or(payload.size());
  std::string frame;
  frame += static_cast<char>((last ? 0x80U : 0U) | opcode);
  if (length < 126) {
    frame += static_cast<char>(0x80U | length);
  } else if (length < 65536) {
    frame += static_cast<char>(0x80U | 126U);
    append_big_endian(frame, length, 2);
  } else {
    frame += static_cast<char>(0x80U | 127U);
    append_big_endian(frame, length, 8);
  }
  frame += kMask;
  for (std::size_t i = 0; i < payload.size(); ++i) {
    frame += static_cast<char>(payload[i] ^ kMask[i % 4]);
  }
  return frame;
}

RawClient::RawClient(std::uint16_t port, int receive_bytes) : port_(port) {
  socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (receive_bytes > 0) {
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
  }
  const timeval patience{.tv_sec = 1, .tv_usec = 0};
  setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    close(socket_);
    throw Error(fmt::format("no server on port {}", port));
  }
}

RawClient::~RawClient() {
  if (socket_ >= 0) close(socket_);
}

RawClient::RawClient(RawClient&& other) noexcept
    : port_(other.port_),
      socket_(std::exchange(other.socket_, -1)),
      close_code_(other.close_code_),
      rest_(std::move(other.rest_)) {}

bool RawClient::send(std::string_view bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

// More of what comes, into rest_. False: closed, or nothing in time.
bool RawClient::fill(double seconds) {
  pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
  if (poll(&ready, 1, std::max(0, static_cast<int>(seconds * 1e3))) <= 0) return false;
  std::array<char, 65536> bytes{};
  const ssize_t count = recv(socket_, bytes.data(), bytes.size(), 0);
  if (count <= 0) return false;
  rest_.append(bytes.data(), static_cast<std::size_t>(count));
  return true;
}

std::string RawClient::read_all(double silence) {
  while (fill(silence)) {
  }
  return std::exchange(rest_, {});
}

bool RawClient::closes_within(double seconds) {
  const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(seconds * 1e9);
  while (monotonic_ns() < end) {
    rest_.clear();
    pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
    if (poll(&ready, 1, 20) > 0 && !fill(0.0)) return true;
  }
  return false;
}

int RawClient::upgrade(const Upgrade& how) {
  const std::string host = how.host.empty() ? fmt::format("127.0.0.1:{}", port_) : how.host;
  send(
      fmt::format("GET {}{}{} HTTP/1.1\r\nHost: {}\r\n{}Upgrade: websocket\r\n"
                  "Connection: Upgrade\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
                  "Sec-WebSocket-Version: 13\r\n\r\n",
                  how.path, how.token.empty() ? "" : "?token=", how.token, host,
                  how.origin.empty() ? "" : fmt::format("Origin: {}\r\n", how.origin)));
  constexpr double kPatience = 20.0;  // s
  std::size_t end = 0;
  while ((end = rest_.find("\r\n\r\n")) == std::string::npos) {
    if (!fill(kPatience)) return 0;
  }
  int code = 0;
  const std::size_t blank = rest_.find(' ');
  if (blank + 4 <= rest_.size()) {
    std::from_chars(rest_.data() + blank + 1, rest_.data() + blank + 4, code);
  }
  rest_.erase(0, end + 4);
  return code;
}

std::optional<std::string> RawClient::hear(double seconds) {
  const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(seconds * 1e9);
  for (;;) {
    const std::optional<FrameHead> head = head_of(rest_);
    if (head && rest_.size() >= head->head + head->payload) {
      const auto opcode = static_cast<unsigned char>(rest_.front()) & 0x0fU;
      std::string payload = rest_.substr(head->head, head->payload);
      rest_.erase(0, head->head + head->payload);
      if (opcode == 1) return payload;
      if (opcode == 8) {
        close_code_ =
            payload.size() >= 2 ? static_cast<int>(big_endian(payload.substr(0, 2))) : 1005;
        return {};
      }
      continue;
    }
    if (!fill(static_cast<double>(end - monotonic_ns()) * 1e-9)) return {};
  }
}

std::optional<std::string> RawClient::hear_of(std::string_view words, double seconds) {
  const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(seconds * 1e9);
  while (monotonic_ns() < end) {
    std::optional<std::string> message = hear(static_cast<double>(end - monotonic_ns()) * 1e-9);
    if (!message) return {};
    if (message->find(words) != std::string::npos) return message;
  }
  return {};
}

}  // namespace photocoag
