// Role: online; the supervisor's check of time: missed periods and commands that came late. Used by
// the supervisor. Rows of the fault table (docs/safety.md): T1, T2, T3.
// Real time: noexcept, bounded, allocation-free.
#pragma once

#include "photocoag/device/device.hpp"
#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/recent.hpp"
#include "photocoag/safety/status.hpp"

namespace photocoag {

inline constexpr int kLateCommandsMax = 3;  ///< in a row

class ClockCheck {
 public:
  /// `late`: the device reports that an older command was in force.
  void check(const DeviceSample& sample, bool late, const SafetyLimits& limits,
             SafetyLatch& latch) noexcept {
    late_commands_ = late ? late_commands_ + 1 : 0;
    if (late) {
      ++latch.status.late_commands;
      latch.notice(SafetyReason::kCommandLate);
    }
    if (late_commands_ > kLateCommandsMax) latch.safe_stop(SafetyReason::kCommandLate, true);
    // A sample that is behind means that the write after it was missed. A late write is as bad.
    const bool behind = sample.periods_behind > 0;
    if (behind) latch.notice(SafetyReason::kOverrun);
    overruns_ = behind || late ? overruns_ + 1 : 0;
    history_.add(behind || late);
    if (overruns_ > limits.overruns_in_a_row_max ||
        history_.among_last(100) > limits.overruns_per_hundred) {
      latch.safe_stop(SafetyReason::kOverrun);
    }
  }

 private:
  int late_commands_ = 0;  // in a row
  int overruns_ = 0;       // in a row
  RecentEvents history_;
};

}  // namespace photocoag
