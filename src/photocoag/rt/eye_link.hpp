// Role: online; the controller's end of the connection to an eye in another process: handshake,
// pulses in, commands out, by either transport. Used by EyeDevice, run, session, apps. Source:
// docs/devices.md, "Transports". Units: SI. Real time: what is noexcept is bounded and
// allocation-free.
// Threads: one owner.
#pragma once

#include <cstdint>
#include <string>

#include "photocoag/rt/eye_protocol.hpp"
#include "photocoag/rt/sealed_memory.hpp"

namespace photocoag {

class EyeLink {
 public:
  /// Connects. Throws Error if there is no eye, it has another controller, is another version, or
  /// `period_ns` is no whole number of its pulse periods.
  EyeLink(const std::string& socket, EyeTransport transport, std::int64_t period_ns);
  ~EyeLink();
  EyeLink(const EyeLink&) = delete;
  EyeLink& operator=(const EyeLink&) = delete;

  const EyeWelcome& welcome() const noexcept { return welcome_; }
  std::uint64_t pulses_per_period() const noexcept { return per_period_; }
  std::uint64_t pulses() const noexcept { return memory_->pulses.load(std::memory_order_acquire); }
  std::uint64_t truths() const noexcept { return memory_->truths.load(std::memory_order_acquire); }
  /// Copies pulse `number`; false if it has not been fired yet or was overwritten.
  bool record(std::uint64_t number, PulseRecord& out) const noexcept;
  const PulseTruth& truth(std::uint64_t number) const noexcept {
    return memory_->truth[number % kEyeRing];
  }

  /// Processes what has come through the socket; with shared memory only its end matters. False:
  /// the eye is gone.
  bool pump() noexcept;
  bool gone() const noexcept { return gone_; }
  /// False if the command could not be delivered.
  bool command(std::uint64_t period, double power, std::uint64_t token) noexcept;
  void safe_off() noexcept;
  void begin(std::uint64_t period) noexcept;
  /// Blocks until the eye confirms lockstep, at most for some seconds. False: it did not.
  bool lockstep() noexcept;
  void grant(std::uint64_t pulses) noexcept;

 private:
  bool tell(EyeMessageKind kind, std::uint64_t period) noexcept;

  EyeTransport transport_;
  int socket_ = -1;
  EyeWelcome welcome_;
  std::uint64_t per_period_ = 1;
  Mapped<EyeSharedMemory> seen_;  // published by the eye
  Mapped<EyeSharedMemory> own_;   // or our own copy that the socket fills
  const EyeSharedMemory* memory_ = nullptr;
  Mapped<EyeOrderMemory> orders_;  // null over the socket
  std::uint64_t granted_ = 0;
  bool in_lockstep_ = false;
  bool gone_ = false;
};

/// Sends one line of text to an eye's socket and returns its answer. Throws Error.
std::string command_eye(const std::string& socket, const std::string& text);

/// Maps what an eye publishes, for an observer. Throws Error.
Mapped<const EyeSharedMemory> observe_eye(const std::string& socket);

}  // namespace photocoag
