// An acquisition program by script, in a thread of its own.
#pragma once

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/udp_device.hpp"

namespace photocoag::testing {

inline constexpr double kPeriod = 0.02;  // s
inline constexpr std::int64_t kPeriodNs = 20'000'000;
inline constexpr std::uint64_t kAllGood = kUdpInterlockClosed | kUdpShutterOpen | kUdpFootSwitch;

inline sockaddr_in local(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

class Sender {
 public:
  Sender() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {}
  ~Sender() { close(socket_); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  std::uint16_t bind_to(std::uint16_t port) {
    sockaddr_in address = local(port);
    socklen_t size = sizeof(address);
    bind(socket_, reinterpret_cast<const sockaddr*>(&address), size);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.sin_port);
  }
  void send(std::uint16_t port, const void* data, std::size_t size) {
    const sockaddr_in to = local(port);
    sendto(socket_, data, size, 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to));
  }
  bool receive(UdpAnswer& answer) {
    return recv(socket_, &answer, sizeof(answer), 0) == sizeof(answer);
  }

 private:
  int socket_;
};

inline std::uint16_t free_port() { return Sender().bind_to(0); }

/// The acquisition program: hello until it is welcome, then the script for each period.
class Program {
 public:
  using Script = std::function<void(Program&, UdpSample)>;

  Program(std::uint16_t port, Script script, UdpHello hello = {})
      : port_(port), script_(std::move(script)), hello_(hello) {
    if (hello_.period_ns == 0) hello_.period_ns = kPeriodNs;
    hello_.simulated = 1;
    std::memcpy(hello_.name.data(), "scripted\n", 9);
    thread_ = std::thread([this] { run(); });
  }
  ~Program() { end(); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void end() {
    over_ = true;
    if (thread_.joinable()) thread_.join();
  }
  template <typename Message>
  void send(const Message& message, std::size_t size = sizeof(Message)) {
    std::array<char, 2 * sizeof(Message)> bytes{};
    std::memcpy(bytes.data(), &message, sizeof(message));
    sender_.send(port_, bytes.data(), size);
  }
  void send_late(const UdpSample& sample, double periods) {
    wait_until(monotonic_ns() + static_cast<std::int64_t>(periods * kPeriod * 1e9));
    send(sample);
  }
  std::uint16_t port() const { return port_; }
  /// After end().
  const std::vector<UdpAnswer>& answers() const { return answers_; }
  bool was_late() const { return latest_ > kPeriodNs * 3 / 10; }

 private:
  void take_answers() {
    for (UdpAnswer answer; sender_.receive(answer);) answers_.push_back(answer);
  }
  void run() {
    while (answers_.empty() && !over_) {
      send(hello_);
      wait_until(monotonic_ns() + kPeriodNs / 2);
      take_answers();
    }
    const std::int64_t start = monotonic_ns();
    for (std::uint64_t n = 1; !over_; ++n) {
      const std::int64_t due = start + static_cast<std::int64_t>(n) * kPeriodNs;
      wait_until(due);
      take_answers();
      latest_ = std::max(latest_, monotonic_ns() - due - lag_);
      UdpSample sample;
      sample.head.session = answers_.front().head.session;
      sample.sequence = n;
      sample.time_ns = due - start + 5;  // a clock of its own
      sample.volume_temperature = static_cast<double>(n);
      sample.power = 0.01;
      sample.command = 0.011;
      sample.raw = static_cast<std::int64_t>(n);
      sample.flags = kAllGood;
      const std::int64_t before = monotonic_ns();
      script_(*this, sample);
      lag_ = monotonic_ns() - before;  // what the script waits is not lateness
    }
    take_answers();
  }

  std::uint16_t port_;
  Script script_;
  UdpHello hello_;
  Sender sender_;
  std::atomic<bool> over_ = false;
  std::vector<UdpAnswer> answers_;
  std::int64_t latest_ = 0;
  std::int64_t lag_ = 0;
  std::thread thread_;
};

}  // namespace photocoag::testing
