// Role: online; the supervisor's status, and the latch through which its checks stop it. Used by
// safety, loop, run, report. Source: docs/safety.md. Units: SI. Real time: noexcept, bounded,
// allocation-free. Threads: one owner.
#pragma once

#include <cstdint>

#include "photocoag/safety/states.hpp"

namespace photocoag {

struct SafetyStatus {
  SafetyState state = SafetyState::kOff;
  SafetyReason reason = SafetyReason::kNone;  ///< of the state, if DONE, SAFE_STOP or STANDBY
  std::int64_t detections = 0;  ///< number of bad samples, rejected commands, overruns and the like
  SafetyReason last_detection = SafetyReason::kNone;
  std::int64_t late_commands = 0;  ///< periods in which an older command was in force
  double energy = 0.0;             ///< J emitted
  double exposure = 0.0;           ///< s with light
  double dose = 0.0;               ///< Arrhenius integral at the largest plausible absorption
};

/// Every check reports to the latch.
class SafetyLatch {
 public:
  /// Counts a detection; the state stays.
  void notice(SafetyReason reason) noexcept {
    ++status.detections;
    status.last_detection = reason;
  }
  /// Counts a detection and changes the state: SAFE_STOP keeps its first reason, from DONE only
  /// SAFE_STOP is reached. `by_interlock`: open the interlock too, as 0 W by software alone is not
  /// trusted.
  void stop(SafetyState state, SafetyReason reason, bool by_interlock = false) noexcept {
    notice(reason);
    open_interlock = open_interlock || by_interlock;
    if (status.state == SafetyState::kSafeStop) return;
    if (status.state == SafetyState::kDone && state != SafetyState::kSafeStop) return;
    status.state = state;
    status.reason = reason;
  }
  void safe_stop(SafetyReason reason, bool by_interlock = false) noexcept {
    stop(SafetyState::kSafeStop, reason, by_interlock);
  }

  SafetyStatus status;
  bool open_interlock = false;
};

}  // namespace photocoag
