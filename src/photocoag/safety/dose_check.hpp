// Role: online; the supervisor's account of energy, time with light and thermal dose, and their
// limits. Used by the supervisor. Row of the fault table (docs/safety.md): X1. Units: SI.
// Real time: noexcept, bounded, allocation-free.
#pragma once

#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/multi_model_observer.hpp"
#include "photocoag/safety/status.hpp"

namespace photocoag {

class DoseCheck {
 public:
  /// One period with `power`, W, which the observer knows already; the dose is that of its hottest
  /// plausible peak. `written`: W, the last power authorized; `on_its_way`: J, written already and
  /// not emitted yet. A treatment stops one period before the limit that the last power would pass.
  void account(double power, double written, double on_its_way, const MultiModelObserver& observer,
               const SafetyLimits& limits, SafetyLatch& latch) noexcept;

  /// W, what the limit of energy leaves for the next period.
  static double power_left(const SafetyStatus& status, double on_its_way,
                           const SafetyLimits& limits) noexcept;

 private:
  double peak_before_ = 0.0;  // K
};

}  // namespace photocoag
