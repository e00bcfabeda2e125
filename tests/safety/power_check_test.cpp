// Whole cycles of late and foreign commands are in command_test.cpp.
#include "photocoag/safety/power_check.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "estimation/test_models.hpp"
#include "safety/supervisors.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Power {
  SafetyLimits limits;
  SafetyLatch latch;
  PowerCheck check;
  explicit Power(double before, double written, std::int64_t delay = 0) {
    limits.command_delay = delay;
    latch.status.state = SafetyState::kTreating;
    check.write(before);
    check.write(written);
  }
  void read(double power, DeviceStatus sample = DeviceStatus::kGood) {
    check.check({.power = power}, InForce::kUnknown, sample, limits, latch);
  }
  SafetyReason reason() const { return latch.status.reason; }
  bool treating() const { return latch.status.state == SafetyState::kTreating; }
};

TEST(PowerCheck, SaysWhatWasInForce) {
  const Power p(0.010, 0.030);
  EXPECT_EQ(p.check.in_force(kNan, p.limits), InForce::kUnknown);
  EXPECT_EQ(p.check.in_force(0.030, p.limits), InForce::kAsWritten);
  EXPECT_EQ(p.check.in_force(0.010, p.limits), InForce::kLate);
  EXPECT_EQ(p.check.in_force(0.020, p.limits), InForce::kLate) << "some of both";
  EXPECT_EQ(p.check.in_force(0.0, p.limits), InForce::kLate) << "a watchdog that waited too long";
  EXPECT_EQ(p.check.in_force(0.050, p.limits), InForce::kForeign);
  const Power delayed(0.010, 0.030, 1);
  EXPECT_EQ(delayed.check.in_force(0.010, delayed.limits), InForce::kAsWritten);
}

TEST(PowerCheck, TheSecondWrongReadbackStopsAndDarkOnesNeitherCountNorClear) {
  Power p(0.02, 0.02);
  p.read(0.02 * (1.0 + kReadbackRelative) - 1e-12);
  EXPECT_EQ(p.latch.status.detections, 0) << "within a fifth";
  p.read(0.03);
  EXPECT_TRUE(p.treating());
  p.check.write(0.0);
  p.read(0.0);
  p.check.write(0.02);
  p.read(0.03);
  EXPECT_EQ(p.reason(), SafetyReason::kPowerReadback);
  EXPECT_TRUE(p.latch.open_interlock);
  Power cleared(0.02, 0.02);
  for (const double power : {0.03, 0.02, 0.03, 0.02}) cleared.read(power);
  EXPECT_TRUE(cleared.treating());
}

TEST(PowerCheck, LightThatNobodyAskedForStopsAtOnce) {
  for (const double power : {kReadbackFloor * 1.01, kNan}) {
    Power p(0.0, 0.0);
    p.read(kReadbackFloor);
    EXPECT_TRUE(p.treating());
    p.read(power);
    EXPECT_EQ(p.reason(), SafetyReason::kPowerStuckOn) << power;
  }
}

TEST(PowerCheck, APowerUnknownForWantOfASampleStopsAsSoonAndSaysSo) {
  Power lit(0.02, 0.02);
  lit.read(kNan, DeviceStatus::kTimeout);
  EXPECT_TRUE(lit.treating());
  EXPECT_EQ(lit.latch.status.last_detection, SafetyReason::kSampleMissing);
  lit.read(kNan, DeviceStatus::kTimeout);
  EXPECT_EQ(lit.reason(), SafetyReason::kSampleMissing);
  EXPECT_TRUE(lit.latch.open_interlock);
  Power dark(0.0, 0.0);
  dark.read(kNan, DeviceStatus::kTimeout);
  EXPECT_EQ(dark.reason(), SafetyReason::kSampleMissing);
  Power known(0.0, 0.0);  // a device that tells of the power, but has no sample
  known.read(0.03, DeviceStatus::kTimeout);
  EXPECT_EQ(known.reason(), SafetyReason::kPowerStuckOn);
}

TEST(PowerCheck, TheLargerPowerCountsWhereTheyDiffer) {
  Power p(0.02, 0.02);
  EXPECT_EQ(p.check.emitted({.power = 0.019}, p.limits), 0.019);
  EXPECT_EQ(p.check.emitted({.power = kNan}, p.limits), 0.02);
  EXPECT_EQ(p.check.emitted({.power = -0.01}, p.limits), 0.02);
  EXPECT_EQ(p.check.emitted({.power = 1.0}, p.limits), 0.02) << "no laser of 0.1 W";
  p.read(0.01);
  EXPECT_EQ(p.check.emitted({.power = 0.01}, p.limits), 0.02);
  EXPECT_EQ(p.check.emitted({.power = 0.03}, p.limits), 0.03);
}

TEST(PowerCheck, AnExcessThatOverheatsIsNotGivenASecondPeriod) {
  MultiModelObserver observer(observer_for(model_1khz()), 0.288, 0.01);
  for (int k = 0; k < 100; ++k) observer.emit(0.015);  // warm; every absorption is plausible
  const auto after = [&](double power) {
    Power p(0.015, 0.015);
    p.read(power);
    p.check.check_excess({.power = power}, observer, p.limits, p.latch);
    return p.treating();
  };
  const double most = observer.power_for_peak(SafetyLimits{}.peak_max);
  ASSERT_GT(most, 0.0);
  ASSERT_LT(most, 0.09);
  EXPECT_TRUE(after(std::max(0.015, most - 1e-6)));
  EXPECT_FALSE(after(std::max(0.02, most + 1e-6)));
}

TEST(PowerCheck, AfterAMissedPeriodTheDeviceMayHoldOrGoDark) {
  for (const std::int64_t delay : {0, 1}) {
    Power p(0.01, 0.03, delay);
    p.check.end_period(true, p.limits);
    for (int k = 0; k <= delay; ++k) {
      EXPECT_EQ(p.check.in_force(0.077, p.limits), InForce::kUnknown);
      p.read(0.0);
      EXPECT_EQ(p.latch.status.detections, 0);
      p.check.end_period(false, p.limits);
    }
    EXPECT_EQ(p.check.in_force(0.077, p.limits), InForce::kForeign);
  }
}

}  // namespace
}  // namespace photocoag::testing
