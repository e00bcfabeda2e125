// Role: online; what the supervisor has found so far, and the latch that its checks stop it by.
// Used by safety, loop, run folders, reports. Source: docs/safety.md. Units: SI. Real time:
// noexcept, bounded, allocation-free. Threads: one owner.
#pragma once

#include <cstdint>

#include "photocoag/safety/states.hpp"

namespace photocoag {

struct SafetyStatus {
  SafetyState state = SafetyState::kOff;
  SafetyReason reason = SafetyReason::kNone;  ///< of the state, if DONE, SAFE_STOP or STANDBY
  std::int64_t detections = 0;  ///< bad samples, rejected commands, overruns: all that was noticed
  SafetyReason last_detection = SafetyReason::kNone;
  std::int64_t late_commands = 0;  ///< periods in which the device had an older one in force
  double energy = 0.0;             ///< J emitted
  double exposure = 0.0;           ///< s with light
  double dose = 0.0;               ///< Arrhenius integral at the largest plausible absorption
};

/// What every check reports to.
class SafetyLatch {
 public:
  /// Counted, nothing else.
  void notice(SafetyReason reason) noexcept {
    ++status.detections;
    status.last_detection = reason;
  }
  /// Noticed, and the state left: SAFE_STOP keeps its first reason, DONE gives way to SAFE_STOP
  /// alone. `by_interlock`: 0 W by software alone is not trusted.
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
