#include "photocoag/core/step_response.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// x' = -x + u and y' = u, exactly under zero-order hold, or by implicit Euler.
class FirstOrder {
 public:
  explicit FirstOrder(Discretization how) : how_(how) {}
  void set_period(double period) { period_ = period; }
  void step(double power) noexcept {
    ++steps;
    volume_ += period_ * power;
    peak_ = how_ == Discretization::kZeroOrderHold
                ? std::exp(-period_) * peak_ - std::expm1(-period_) * power
                : (peak_ + period_ * power) / (1.0 + period_);
  }
  Outputs outputs() const noexcept { return {.volume = volume_, .peak = peak_}; }
  int steps = 0;

 private:
  Discretization how_;
  double period_ = 1.0;
  double volume_ = 0.0;
  double peak_ = 0.0;
};

TEST(StepResponse, ZeroOrderHoldIsExactAtAnyTimesInAnyOrder) {
  FirstOrder system(Discretization::kZeroOrderHold);
  const std::vector<double> times = {0.3, 2.0, 0.0, 0.3, 1e-7, 0.7071};
  const auto outputs =
      sample_step_response(system, Discretization::kZeroOrderHold, 1.0, 3.0, times);
  ASSERT_EQ(outputs.size(), times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    // A handful of roundings.
    EXPECT_NEAR(outputs[i].peak, -3.0 * std::expm1(-times[i]), 1e-14) << times[i];
    EXPECT_NEAR(outputs[i].volume, 3.0 * times[i], 1e-14) << times[i];
  }
  EXPECT_EQ(system.steps, 4);  // one per distinct time above 0
}

TEST(StepResponse, ImplicitEulerAdvancesInWholePeriods) {
  FirstOrder system(Discretization::kImplicitEuler);
  const std::vector<double> times = {0.5, 0.1, 0.0, 0.3};
  const auto outputs =
      sample_step_response(system, Discretization::kImplicitEuler, 0.1, 2.0, times);
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(outputs[i].peak, 2.0 * (1.0 - std::pow(1.1, -std::round(times[i] / 0.1))), 1e-14);
  }
  EXPECT_EQ(system.steps, 5);
}

TEST(StepResponse, ImplicitEulerRefusesTimesBetweenPeriodsBeforeAnyStep) {
  FirstOrder system(Discretization::kImplicitEuler);
  EXPECT_THROW(sample_step_response(system, Discretization::kImplicitEuler, 0.1, 2.0, {0.1, 0.25}),
               Error);
  EXPECT_EQ(system.steps, 0);
}

TEST(StepResponse, WholePeriodsToleratesRoundingOnly) {
  EXPECT_EQ(whole_periods(0.0, 1e-3), 0U);
  EXPECT_EQ(whole_periods(0.3, 0.1), 3U);  // 0.3 / 0.1 is not 3 in binary
  EXPECT_EQ(whole_periods(1e4, 1e-4), 100000000U);
  EXPECT_EQ(whole_periods(0.4 * (1.0 + 1e-12), 1e-3), 400U);
  EXPECT_THROW(whole_periods(0.4001, 1e-3), Error);
  EXPECT_THROW(whole_periods(0.5e-3, 1e-3), Error);
  EXPECT_THROW(whole_periods(1e-5, 1e-3), Error);
}

TEST(StepResponse, RefusesTimesThatAreNoTimes) {
  for (const double bad : {-1e-9, 10001.0, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(ascending_times({0.1, bad}), Error) << bad;
  }
  EXPECT_EQ(ascending_times({0.3, 0.1, 0.2, 0.1}), (std::vector<std::size_t>{1, 3, 2, 0}));
  EXPECT_TRUE(ascending_times({}).empty());
}

}  // namespace
}  // namespace photocoag
