#include "photocoag/safety/estimate_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "estimation/test_models.hpp"
#include "safety/supervisors.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Estimates {
  SafetyLimits limits;
  SafetyLatch latch;
  MultiModelObserver observer{observer_for(model_1khz()), 0.288, 0.01};
  EstimateCheck check;
  std::int64_t cycle = 0;
  Estimates() { latch.status.state = SafetyState::kTreating; }

  ControllerReport healthy() {
    ++cycle;
    return {.updated = true,
            .peak = 20.0,
            .absorption = 1.1,
            .innovation = cycle % 2 == 0 ? 0.3 : -0.25,
            .innovation_sigma = 0.288};
  }
  void judge(const ControllerReport& report) {
    check.check(report, cycle, observer, limits, latch);
  }
  bool treating() const { return latch.status.state == SafetyState::kTreating; }
  /// After 30 healthy cycles the spoiled report that stops is number …; 0: none of 50.
  template <typename Spoil>
  int stops_at(const Spoil& spoil) {
    for (int k = 0; k < 30; ++k) judge(healthy());
    EXPECT_EQ(latch.status.detections, 0);
    for (int k = 1; k <= 50; ++k) {
      ControllerReport report = healthy();
      spoil(report, k);
      judge(report);
      if (!treating()) return k;
    }
    return 0;
  }
};

TEST(EstimateCheck, EachKindStopsAfterItsOwnCount) {
  using R = ControllerReport;
  Estimates restarted;
  EXPECT_EQ(restarted.stops_at([](R& r, int) { r.restarted = true; }), kRestartsMax + 1);
  EXPECT_EQ(restarted.latch.status.reason, SafetyReason::kEstimatorRestart);
  for (const double alpha : {0.2, 2.0, -1.0, kNan}) {  // at a bound of the estimator, beyond, none
    Estimates bound;
    EXPECT_EQ(bound.stops_at([&](R& r, int) { r.absorption = alpha; }), kAbsorptionBadMax + 1);
    EXPECT_EQ(bound.latch.status.reason, SafetyReason::kAbsorption);
  }
  const auto to_and_fro = [](double by) {
    return [by](R& r, int k) { r.absorption = k % 2 == 0 ? 1.1 : 1.1 + by; };
  };
  EXPECT_EQ(Estimates().stops_at(to_and_fro(kAbsorptionJump + 0.01)), kAbsorptionBadMax + 1);
  EXPECT_EQ(Estimates().stops_at(to_and_fro(kAbsorptionJump - 0.01)), 0);
  for (const double peak : {33.1, kNan}) {
    Estimates hot;
    EXPECT_EQ(hot.stops_at([&](R& r, int) { r.peak = peak; }), kPeakEstimatesMax + 1);
    EXPECT_EQ(hot.latch.status.reason, SafetyReason::kEstimatedPeak);
  }
  EXPECT_EQ(Estimates().stops_at([](R& r, int) { r.peak = 33.0; }), 0);
}

TEST(EstimateCheck, InnovationsMayBeNeitherTooLargeNorTooSmall) {
  using R = ControllerReport;
  Estimates loud;
  EXPECT_GT(loud.stops_at([](R& r, int) { r.innovation = 0.9; }), 0);
  EXPECT_EQ(loud.latch.status.reason, SafetyReason::kInconsistent);
  // An estimator that expects them so large has said so.
  EXPECT_EQ(Estimates().stops_at([](R& r, int) {
    r.innovation = 0.9;
    r.innovation_sigma = 0.9;
  }),
            0);
  Estimates quiet;
  EXPECT_GT(quiet.stops_at([](R& r, int) { r.innovation = 0.001; }), 0);
  EXPECT_EQ(quiet.latch.status.reason, SafetyReason::kInconsistent);
  Estimates silent;
  silent.limits.check_quiet = 0;
  EXPECT_EQ(silent.stops_at([](R& r, int) { r.innovation = 0.0; }), 0);
  EXPECT_GT(Estimates().stops_at([](R& r, int) { r.innovation = kNan; }), 0);
  EXPECT_EQ(Estimates().stops_at([](R& r, int) {
    r.updated = false;
    r.innovation = 100.0;
  }),
            0)
      << "no sample was used";
}

TEST(EstimateCheck, ABadAbsorptionMakesTheObserverForget) {
  Estimates e;
  for (int k = 0; k < 50; ++k) {
    e.observer.emit(0.02);
    e.observer.update(12.0);
  }
  const double before = e.observer.absorption_high();
  ControllerReport report = e.healthy();
  report.absorption = 5.0;
  e.judge(report);
  EXPECT_GT(e.observer.absorption_high(), before);
}

TEST(EstimateCheck, NoLightInTheCycleOfAPeakThatIsTooHigh) {
  Estimates e;
  ControllerReport report = e.healthy();
  report.peak = 40.0;
  e.judge(report);
  EXPECT_TRUE(e.check.too_hot());
  EXPECT_TRUE(e.treating());
  e.judge(e.healthy());
  EXPECT_FALSE(e.check.too_hot());
}

}  // namespace
}  // namespace photocoag::testing
