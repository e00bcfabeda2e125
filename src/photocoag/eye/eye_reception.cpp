#include "photocoag/eye/eye_reception.hpp"

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
constexpr int kLook = 20;  // ms
}

EyeReception::~EyeReception() {
  for (const int guest : guests_) close(guest);
}

void EyeReception::run() {
  while (!desk_.end.load()) {
    std::vector<pollfd> waits = {{.fd = listener_.socket(), .events = POLLIN, .revents = 0}};
    for (const int guest : guests_) waits.push_back({.fd = guest, .events = POLLIN, .revents = 0});
    if (poll(waits.data(), waits.size(), kLook) <= 0) continue;
    for (std::size_t i = 1; i < waits.size(); ++i) {
      if (waits[i].revents != 0) serve(waits[i].fd);
    }
    if (waits[0].revents != 0) let_in();
  }
}

void EyeReception::let_in() {
  if (guests_.size() >= kMostGuests) drop(guests_.front(), true);
  const int guest = listener_.accept();
  if (guest >= 0) {
    guests_.push_back(guest);
    return;
  }
  // Out of descriptors, or a connection of another user.
  if (!guests_.empty() && (errno == EMFILE || errno == ENFILE)) drop(guests_.front(), true);
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void EyeReception::drop(int guest, bool closing) {
  guests_.erase(std::find(guests_.begin(), guests_.end(), guest));
  if (closing) close(guest);
}

void EyeReception::say(int guest, const std::string& text) {
  send_message(guest, text.data(), text.size());
}

void EyeReception::serve(int guest) {
  std::array<char, 1024> message{};
  const long got = receive_message(guest, message.data(), message.size(), 0);
  if (got == kNoMessage) return;
  if (got == kMessageTooLong) return say(guest, "refused: too long");
  if (got == 0) return drop(guest, true);
  EyeHello hello;
  if (got == static_cast<long>(sizeof(hello))) {
    std::memcpy(&hello, message.data(), sizeof(hello));
    if (hello.kind == EyeMessageKind::kHello) return welcome(guest, hello);
  }
  answer(guest, std::string(message.data(), static_cast<std::size_t>(got)));
}

void EyeReception::welcome(int guest, const EyeHello& hello) {
  const bool good = hello.magic == kEyeMagic && hello.pulses_per_period >= 1 &&
                    hello.pulses_per_period <= kMostPulsesPerPeriod &&
                    !desk_.attached.exchange(true);
  if (!good) {
    say(guest, "refused: another controller is attached, or another version");
    return drop(guest, true);
  }
  const EyeWelcome welcome{.start_ns = desk_.memory->start_ns.load(),
                           .pulse_period_ns = desk_.pulse_ns,
                           .states = desk_.states,
                           .power_max = desk_.power_max,
                           .abilities = (desk_.priority.load() ? kEyeHasPriority : 0U) |
                                        (faults_.takes_wall_time() ? kEyeNeedsWall : 0U)};
  client_ = {guest, hello.pulses_per_period, nullptr};
  if (hello.transport == EyeTransport::kSharedMemory) {
    std::array<int, 2> descriptors{desk_.descriptor, -1};
    try {
      client_.orders = make_sealed<EyeOrderMemory>(Access::kWrite, descriptors[1]);
    } catch (const Error& error) {
      desk_.attached.store(false);
      say(guest, std::string("refused: ") + error.what());
      return drop(guest, true);
    }
    client_.orders->magic = kEyeMagic;
    client_.orders->size = sizeof(EyeOrderMemory);
    send_message(guest, &welcome, sizeof(welcome), descriptors);
    close(descriptors[1]);
  } else {
    send_message(guest, &welcome, sizeof(welcome));
  }
  drop(guest, false);
  desk_.arriving.store(&client_, std::memory_order_release);
}

std::string EyeReception::status() const {
  return fmt::format(
      "pulses={} late={} watchdog={} refused={} lit={} attached={} lockstep={} work_p50_us={:g} "
      "work_p99_us={:g} work_max_us={:.1f}",
      desk_.memory->pulses.load(), desk_.late.load(), desk_.watchdog.load(), desk_.refused.load(),
      desk_.lit.load(), desk_.attached.load() ? 1 : 0, desk_.lockstep.load() ? 1 : 0,
      desk_.work_p50.load(), desk_.work_p99.load(), desk_.work_max.load());
}

void EyeReception::answer(int guest, const std::string& text) {
  constexpr std::string_view kFault = "fault ";
  if (text == "pulse-period") return say(guest, fmt::format("{}", desk_.pulse_ns));
  if (text == "status") return say(guest, status());
  if (text == "observe") {
    send_message(guest, "memory", 6, std::span(&desk_.descriptor, 1));
    return;
  }
  if (text == "cold") {
    desk_.cold.store(true);
    return say(guest, "ok");
  }
  if (text.starts_with(kFault)) return add_fault(guest, text.substr(kFault.size()));
  say(guest, fmt::format("refused: no such command: {} (accepted: status, cold, fault ID@cycle)",
                         text.substr(0, 80)));
}

void EyeReception::add_fault(int guest, const std::string& text) {
  try {
    const ScriptedFault fault = parse_fault(text, "fault");
    if (takes_wall_time(fault) && desk_.lockstep.load()) {
      return say(guest,
                 "refused: the eye is in lockstep, where nothing comes late; "
                 "photoacoustics.eye_pacing = \"wall\"");
    }
    say(guest, faults_.add(fault) ? "ok" : "refused: too many faults");
  } catch (const Error& error) {
    say(guest, std::string("refused: ") + error.what());
  }
}

}  // namespace photocoag
