// Role: online; a device that has served a self-test already, as a new one: cycles, sequence
// numbers and tokens go on from there; wake-ups and cycles are timed, and a stop flag is looked at.
// Used by run. Real time: noexcept, no allocation after construction.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "photocoag/device/device.hpp"
#include "photocoag/loop/record.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {

template <Device D>
class ContinuedDevice {
 public:
  /// `sequence`, `token`: the last ones used.
  ContinuedDevice(D& device, std::uint64_t sequence, std::uint64_t token, std::size_t cycles,
                  const std::atomic<bool>& stop)
      : device_(device), sequence_(sequence), token_(token), stop_(stop) {
    timing_.wake_late.reserve(cycles);
    timing_.cycle.reserve(cycles);
  }

  DeviceSample wait_sample(std::uint64_t cycle) noexcept {
    DeviceSample sample = device_.wait_sample(cycle + sequence_);
    woke_ns_ = monotonic_ns();
    if (timing_.wake_late.size() < timing_.wake_late.capacity()) {
      timing_.wake_late.push_back(woke_ns_ - sample.time_ns);
    }
    sample.sequence -= sample.sequence > sequence_ ? sequence_ : sample.sequence;
    sample.stop_asked = sample.stop_asked || stop_.load(std::memory_order_relaxed);
    return sample;
  }
  Readback readback() noexcept { return device_.readback(); }
  DeviceStatus write_power(double power, std::uint64_t token) noexcept {
    return device_.write_power(power, token + token_);
  }
  void heartbeat(std::uint64_t cycle) noexcept {
    device_.heartbeat(cycle + sequence_);
    if (timing_.cycle.size() < timing_.cycle.capacity()) {
      timing_.cycle.push_back(monotonic_ns() - woke_ns_);
    }
  }
  void safe_off() noexcept { device_.safe_off(); }
  const LoopTiming& timing() const noexcept { return timing_; }

 private:
  D& device_;
  std::uint64_t sequence_;
  std::uint64_t token_;
  const std::atomic<bool>& stop_;
  std::int64_t woke_ns_ = 0;
  LoopTiming timing_;
};

}  // namespace photocoag
