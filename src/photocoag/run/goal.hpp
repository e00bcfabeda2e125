// Role: online; whether a treatment's goal is reached. Used by run. Source: docs/equations.md (E24)
// for the dose. Based on the estimate, as the true peak cannot be measured; the limit that does not
// rely on it is the supervisor's (safety.thermal_dose_max). Real time: reached() is noexcept, no
// allocation.
#pragma once

#include "photocoag/config/config.hpp"
#include "photocoag/tissue/thermal_dose.hpp"

namespace photocoag {

/// Periods that the controller missed count neither for the hold nor for the dose.
class GoalWatch {
 public:
  GoalWatch() = default;
  explicit GoalWatch(const Config& config)
      : goal_(config.run.goal),
        period_(config.control.period),
        hold_(config.run.hold),
        peak_reference_(config.control.peak_reference),
        wanted_dose_(config.run.dose),
        ambient_(config.tissue.ambient_celsius),
        celsius_(ambient_) {}

  /// Once per cycle; `peak`: estimate at its end, K.
  void add(double peak) noexcept {
    const double next = ambient_ + peak;
    dose_ += damage_over(kPublishedDamage[0], celsius_, next, period_);
    celsius_ = next;
    if (photocoag::reached(peak, peak_reference_)) held_ += period_;
  }
  bool reached() const noexcept {
    // Half a period of slack for rounding of the sum.
    if (goal_ == Goal::kHold) return held_ + 0.5 * period_ > hold_;
    return goal_ == Goal::kDose && dose_ >= wanted_dose_;
  }

  double held() const noexcept { return held_; }  ///< s
  double dose() const noexcept { return dose_; }

 private:
  Goal goal_ = Goal::kDuration;
  double period_ = 0.0;
  double hold_ = 0.0;
  double peak_reference_ = 0.0;
  double wanted_dose_ = 0.0;
  double ambient_ = 0.0;
  double celsius_ = 0.0;
  double held_ = 0.0;
  double dose_ = 0.0;
};

}  // namespace photocoag
