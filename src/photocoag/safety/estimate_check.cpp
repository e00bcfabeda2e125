#include "photocoag/safety/estimate_check.hpp"

#include <algorithm>
#include <cmath>

namespace photocoag {

void EstimateCheck::check(const ControllerReport& report, std::int64_t cycle,
                          MultiModelObserver& observer, const SafetyLimits& limits,
                          SafetyLatch& latch) noexcept {
  if (report.restarted) {
    latch.notice(SafetyReason::kEstimatorRestart);
    if (++restarts_ > kRestartsMax) latch.safe_stop(SafetyReason::kEstimatorRestart);
  }
  const double settling = settling_;  // of the cycles before
  check_absorption(report.absorption, cycle, observer, limits, latch);
  if (report.updated) check_innovation(report, settling, observer, limits, latch);
  // NaN counts as too high.
  too_hot_ = !(report.peak <= limits.peak_max + kPeakEstimateExcess) ? too_hot_ + 1 : 0;
  if (too_hot_ > kPeakEstimatesMax) latch.safe_stop(SafetyReason::kEstimatedPeak);
}

void EstimateCheck::check_absorption(double absorption, std::int64_t cycle,
                                     MultiModelObserver& observer, const SafetyLimits& limits,
                                     SafetyLatch& latch) noexcept {
  const bool outside = !(absorption > limits.absorption_min && absorption < limits.absorption_max);
  const bool jumped =
      cycle > kAbsorptionSettled && std::abs(absorption - absorption_) > kAbsorptionJump;
  const bool settles = cycle > 0 && cycle <= kAbsorptionSettled;
  const double moved = settles ? std::clamp(1.0 - absorption_ / absorption, -1.0, 1.0) : 0.0;
  settling_ = settles ? std::max(0.5 * settling_, moved * moved) : 0.0;
  absorption_ = absorption;
  absorption_bad_ = outside || jumped ? absorption_bad_ + 1 : 0;
  if (absorption_bad_ > 0) {
    latch.notice(SafetyReason::kAbsorption);
    observer.reset();
  }
  if (absorption_bad_ > kAbsorptionBadMax) latch.safe_stop(SafetyReason::kAbsorption);
}

// Innovations may be as large as the estimator expects, the calibrated noise, the model error or
// the estimator's linearization error. They are never smaller than the noise.
void EstimateCheck::check_innovation(const ControllerReport& report, double settling,
                                     const MultiModelObserver& observer, const SafetyLimits& limits,
                                     SafetyLatch& latch) noexcept {
  const double square = report.innovation * report.innovation;
  const double noise = limits.noise * limits.noise;
  const double expected = report.innovation_sigma * report.innovation_sigma;
  const double model = (limits.model_error + kSettlingShare * settling) * observer.volume_high();
  innovations_.add(square);
  excess_.add(square / std::max({expected, noise, model * model}));
  const bool quiet =
      limits.check_quiet != 0 && innovations_.full() && innovations_.sum() < kQuietest * noise;
  if (!(excess_.sum() <= kNoisiest) || quiet) latch.safe_stop(SafetyReason::kInconsistent);
}

}  // namespace photocoag
