#include "photocoag/eye/eye_socket_server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <string_view>
#include <thread>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {
constexpr int kPollMs = 20;  // ms
}

EyeSocketServer::~EyeSocketServer() {
  for (const int peer : peers_) close(peer);
}

void EyeSocketServer::run() {
  while (!shared_.end.load()) {
    std::vector<pollfd> waits = {{.fd = listener_.socket(), .events = POLLIN, .revents = 0}};
    for (const int peer : peers_) waits.push_back({.fd = peer, .events = POLLIN, .revents = 0});
    if (poll(waits.data(), waits.size(), kPollMs) <= 0) continue;
    for (std::size_t i = 1; i < waits.size(); ++i) {
      if (waits[i].revents != 0) serve(waits[i].fd);
    }
    if (waits[0].revents != 0) accept_peer();
  }
}

void EyeSocketServer::accept_peer() {
  if (peers_.size() >= kMostPeers) drop(peers_.front(), true);
  const int peer = listener_.accept();
  if (peer >= 0) {
    peers_.push_back(peer);
    return;
  }
  // Out of descriptors, or a connection of another user.
  if (!peers_.empty() && (errno == EMFILE || errno == ENFILE)) drop(peers_.front(), true);
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void EyeSocketServer::drop(int peer, bool closing) {
  peers_.erase(std::find(peers_.begin(), peers_.end(), peer));
  if (closing) close(peer);
}

void EyeSocketServer::say(int peer, const std::string& text) {
  send_message(peer, text.data(), text.size());
}

void EyeSocketServer::serve(int peer) {
  std::array<char, 1024> message{};
  const long got = receive_message(peer, message.data(), message.size(), 0);
  if (got == kNoMessage) return;
  if (got == kMessageTooLong) return say(peer, "refused: too long");
  if (got == 0) return drop(peer, true);
  EyeHello hello;
  if (got == static_cast<long>(sizeof(hello))) {
    std::memcpy(&hello, message.data(), sizeof(hello));
    if (hello.kind == EyeMessageKind::kHello) return welcome(peer, hello);
  }
  answer(peer, std::string(message.data(), static_cast<std::size_t>(got)));
}

void EyeSocketServer::welcome(int peer, const EyeHello& hello) {
  const bool good = hello.magic == kEyeMagic && hello.pulses_per_period >= 1 &&
                    hello.pulses_per_period <= kMostPulsesPerPeriod &&
                    !shared_.attached.exchange(true);
  if (!good) {
    say(peer, "refused: another controller is attached, or another version");
    return drop(peer, true);
  }
  const EyeWelcome welcome{.start_ns = shared_.memory->start_ns.load(),
                           .pulse_period_ns = shared_.pulse_ns,
                           .states = shared_.states,
                           .power_max = shared_.power_max,
                           .abilities = (shared_.priority.load() ? kEyeHasPriority : 0U) |
                                        (faults_.takes_wall_time() ? kEyeNeedsWall : 0U)};
  client_ = {peer, hello.pulses_per_period, nullptr};
  if (hello.transport == EyeTransport::kSharedMemory) {
    std::array<int, 2> descriptors{shared_.descriptor, -1};
    try {
      client_.orders = make_sealed<EyeOrderMemory>(Access::kWrite, descriptors[1]);
    } catch (const Error& error) {
      shared_.attached.store(false);
      say(peer, std::string("refused: ") + error.what());
      return drop(peer, true);
    }
    client_.orders->magic = kEyeMagic;
    client_.orders->size = sizeof(EyeOrderMemory);
    send_message(peer, &welcome, sizeof(welcome), descriptors);
    close(descriptors[1]);
  } else {
    send_message(peer, &welcome, sizeof(welcome));
  }
  drop(peer, false);
  shared_.arriving.store(&client_, std::memory_order_release);
}

std::string EyeSocketServer::status() const {
  return fmt::format(
      "pulses={} late={} watchdog={} refused={} lit={} attached={} lockstep={} work_p50_us={:g} "
      "work_p99_us={:g} work_max_us={:.1f}",
      shared_.memory->pulses.load(), shared_.late.load(), shared_.watchdog.load(),
      shared_.refused.load(), shared_.lit.load(), shared_.attached.load() ? 1 : 0,
      shared_.lockstep.load() ? 1 : 0, shared_.work_p50.load(), shared_.work_p99.load(),
      shared_.work_max.load());
}

void EyeSocketServer::answer(int peer, const std::string& text) {
  constexpr std::string_view kFault = "fault ";
  if (text == "pulse-period") return say(peer, fmt::format("{}", shared_.pulse_ns));
  if (text == "status") return say(peer, status());
  if (text == "observe") {
    send_message(peer, "memory", 6, std::span(&shared_.descriptor, 1));
    return;
  }
  if (text == "cold") {
    shared_.cold.store(true);
    return say(peer, "ok");
  }
  if (text.starts_with(kFault)) return add_fault(peer, text.substr(kFault.size()));
  say(peer, fmt::format("refused: no such command: {} (accepted: status, cold, fault ID@cycle)",
                        text.substr(0, 80)));
}

void EyeSocketServer::add_fault(int peer, const std::string& text) {
  try {
    const ScriptedFault fault = parse_fault(text, "fault");
    if (takes_wall_time(fault) && shared_.lockstep.load()) {
      return say(peer,
                 "refused: the eye is in lockstep, where nothing comes late; "
                 "photoacoustics.eye_pacing = \"wall\"");
    }
    say(peer, faults_.add(fault) ? "ok" : "refused: too many faults");
  } catch (const Error& error) {
    say(peer, std::string("refused: ") + error.what());
  }
}

}  // namespace photocoag
