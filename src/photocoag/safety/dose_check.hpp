// Role: online; the supervisor's totals of energy, exposure and thermal dose, and their limits.
// Used by the supervisor. Row of the fault table (docs/safety.md): X1. Units: SI.
// Real time: noexcept, bounded, allocation-free.
#pragma once

#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/multi_model_observer.hpp"
#include "photocoag/safety/status.hpp"

namespace photocoag {

class DoseCheck {
 public:
  /// One period with `power`, W, already passed to the observer; the dose is that of its hottest
  /// plausible peak. `written`: W, the last power authorized; `on_its_way`: J, written but not yet
  /// emitted. The treatment stops one period before the last power would exceed a limit.
  void account(double power, double written, double on_its_way, const MultiModelObserver& observer,
               const SafetyLimits& limits, SafetyLatch& latch) noexcept;

  /// W, the largest power that the energy limit allows for the next period.
  static double power_left(const SafetyStatus& status, double on_its_way,
                           const SafetyLimits& limits) noexcept;

 private:
  double peak_before_ = 0.0;  // K
};

}  // namespace photocoag
