// Role: online; a device that has served a self-test already, as a new one: cycles, sequence
// numbers and tokens go on from there. Used by run. Real time: noexcept, no allocation.
#pragma once

#include <cstdint>

#include "photocoag/device/device.hpp"

namespace photocoag {

template <Device D>
class ContinuedDevice {
 public:
  /// `sequence`, `token`: the last ones used.
  ContinuedDevice(D& device, std::uint64_t sequence, std::uint64_t token)
      : device_(device), sequence_(sequence), token_(token) {}

  DeviceSample wait_sample(std::uint64_t cycle) noexcept {
    DeviceSample sample = device_.wait_sample(cycle + sequence_);
    sample.sequence -= sample.sequence > sequence_ ? sequence_ : sample.sequence;
    return sample;
  }
  Readback readback() noexcept { return device_.readback(); }
  DeviceStatus write_power(double power, std::uint64_t token) noexcept {
    return device_.write_power(power, token + token_);
  }
  void heartbeat(std::uint64_t cycle) noexcept { device_.heartbeat(cycle + sequence_); }
  void safe_off() noexcept { device_.safe_off(); }

 private:
  D& device_;
  std::uint64_t sequence_;
  std::uint64_t token_;
};

}  // namespace photocoag
