// Role: online; a recorded run as a Device that delivers the recorded samples. The powers that the
// loop writes are compared bit for bit with those recorded. Used by `replay`, tests. Source:
// docs/devices.md. Real time: noexcept, no allocation.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "photocoag/device/device.hpp"

namespace photocoag {

/// The recorded data of one period, and the power written before it.
struct ReplayCycle {
  double written = 0.0;  ///< W, for this period; NaN if not known
  DeviceSample sample;
  Readback readback;
};

class ReplayDevice {
 public:
  explicit ReplayDevice(std::span<const ReplayCycle> cycles) : cycles_(cycles) {}

  DeviceSample wait_sample(std::uint64_t cycle) noexcept {
    now_ = static_cast<std::size_t>(cycle);
    // Beyond the end of the recording the device is gone.
    return now_ < cycles_.size() ? cycles_[now_].sample
                                 : DeviceSample{.status = DeviceStatus::kGone};
  }
  Readback readback() noexcept {
    return now_ < cycles_.size() ? cycles_[now_].readback : Readback{};
  }
  DeviceStatus write_power(double power, std::uint64_t) noexcept {
    const std::size_t next = started_ ? now_ + 1 : 0;
    started_ = true;
    if (next < cycles_.size() && !std::isnan(cycles_[next].written)) {
      ++compared_;
      const bool same = std::bit_cast<std::uint64_t>(power) ==
                        std::bit_cast<std::uint64_t>(cycles_[next].written);
      if (!same && differs_at_ == kNowhere) differs_at_ = next;
    }
    return DeviceStatus::kGood;
  }
  void heartbeat(std::uint64_t) noexcept {}
  void safe_off() noexcept {}

  static constexpr std::size_t kNowhere = SIZE_MAX;
  /// First period whose power differs in any bit from the recorded one.
  std::size_t differs_at() const noexcept { return differs_at_; }
  std::size_t compared() const noexcept { return compared_; }

 private:
  std::span<const ReplayCycle> cycles_;
  std::size_t now_ = 0;
  bool started_ = false;
  std::size_t compared_ = 0;
  std::size_t differs_at_ = kNowhere;
};
static_assert(Device<ReplayDevice>);

}  // namespace photocoag
