// Role: online; the supervisor's check of the device itself: present, last write accepted,
// interlock closed, shutter open, foot switch pressed. Used by the supervisor. Rows of the fault
// table (docs/safety.md): A3, A4, A5. Real time: noexcept, bounded, allocation-free.
#pragma once

#include "photocoag/device/device.hpp"
#include "photocoag/safety/status.hpp"

namespace photocoag {

/// No counters: each of these stops at once.
inline void check_device(const DeviceSample& sample, const Readback& readback,
                         DeviceStatus last_write, SafetyLatch& latch) noexcept {
  if (sample.status == DeviceStatus::kGone || last_write == DeviceStatus::kGone) {
    latch.safe_stop(SafetyReason::kDeviceGone, true);
  } else if (last_write != DeviceStatus::kGood) {
    latch.safe_stop(SafetyReason::kWriteFailed, true);
  }
  if (!readback.interlock_closed) latch.safe_stop(SafetyReason::kInterlock);
  if (!readback.shutter_open) latch.safe_stop(SafetyReason::kShutter);
  if (!readback.foot_switch) latch.stop(SafetyState::kStandby, SafetyReason::kFootSwitch);
}

}  // namespace photocoag
