// Role: online; the supervisor's check of the controller's estimates: restarts, absorption,
// innovations, peak. Used by the supervisor. Rows of the fault table (docs/safety.md): E1 to E4.
// Units: SI. Real time: noexcept, bounded, allocation-free.
#pragma once

#include <cstdint>

#include "photocoag/safety/controller_report.hpp"
#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/multi_model_observer.hpp"
#include "photocoag/safety/recent.hpp"
#include "photocoag/safety/status.hpp"

namespace photocoag {

inline constexpr int kRestartsMax = 1;                  ///< in a treatment
inline constexpr int kAbsorptionBadMax = 9;             ///< in a row
inline constexpr double kAbsorptionJump = 0.3;          ///< 1, of alpha from cycle to cycle
inline constexpr std::int64_t kAbsorptionSettled = 10;  ///< cycles
inline constexpr double kPeakEstimateExcess = 1.0;      ///< K
inline constexpr int kPeakEstimatesMax = 2;             ///< in a row
/// Temperatures are not linear in alpha: linearization error of an estimator after alpha has moved,
/// as a share of the temperature times the square of the relative move.
inline constexpr double kSettlingShare = 0.25;

class EstimateCheck {
 public:
  /// `cycle`: number of the samples checked so far.
  void check(const ControllerReport& report, std::int64_t cycle, MultiModelObserver& observer,
             const SafetyLimits& limits, SafetyLatch& latch) noexcept;
  /// The estimated peak exceeds the limit or is NaN: no light in this cycle.
  bool too_hot() const noexcept { return too_hot_ > 0; }

 private:
  void check_absorption(double absorption, std::int64_t cycle, MultiModelObserver& observer,
                        const SafetyLimits& limits, SafetyLatch& latch) noexcept;
  void check_innovation(const ControllerReport& report, double settling,
                        const MultiModelObserver& observer, const SafetyLimits& limits,
                        SafetyLatch& latch) noexcept;

  int restarts_ = 0;
  int absorption_bad_ = 0;
  int too_hot_ = 0;
  double absorption_ = 0.0;  // at the last cycle
  double settling_ = 0.0;    // square of the estimate's recent relative move
  RecentSum innovations_;    // K^2, squared
  RecentSum excess_;         // relative to the largest expected variance
};

}  // namespace photocoag
