// The gate alone, and what it does for the filter: lone outliers stay out, lasting changes get in.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "estimation/test_models.hpp"
#include "photocoag/estimation/ekf.hpp"
#include "photocoag/estimation/outlier_gate.hpp"

namespace photocoag::testing {
namespace {

TEST(OutlierGate, PassesWhatIsInsideAndRejectsALoneOutlier) {
  OutlierGate gate(6.0);
  EXPECT_TRUE(gate.passes(6.0, 1.0));
  EXPECT_FALSE(gate.passes(6.1, 1.0));
  EXPECT_TRUE(gate.passes(-6.0, 1.0));
  // The sample inside has closed it again.
  EXPECT_FALSE(gate.passes(-6.1, 1.0));
}

TEST(OutlierGate, ALastingChangeIsRejectedAtMostLogarithmicallyOften) {
  for (const double change : {7.0, 11.0, 13.0, 50.0, 1e3, 1e6, 1e12}) {
    OutlierGate gate(6.0);
    int rejected = 0;
    while (!gate.passes(change, 1.0)) ++rejected;
    EXPECT_EQ(rejected, static_cast<int>(std::ceil(std::log2(change / 6.0)))) << change;
    // And it stays in while the estimate follows, until as many samples are inside the plain gate.
    for (int k = 0; k < 5; ++k) EXPECT_TRUE(gate.passes(change, 1.0)) << change;
    for (int k = 0; k < rejected; ++k) EXPECT_TRUE(gate.passes(1.0, 1.0)) << change;
    EXPECT_FALSE(gate.passes(change, 1.0)) << change;
  }
}

TEST(OutlierGate, ZeroMeansNoGateAndNothingIsLockedOutForEver) {
  OutlierGate none(0.0);
  EXPECT_TRUE(none.passes(1e300, 1e-300));
  // Not finite ones are for the filter's own check.
  OutlierGate gate(6.0);
  EXPECT_TRUE(gate.passes(std::numeric_limits<double>::quiet_NaN(), 1.0));
  int rejected = 0;
  while (!gate.passes(1e15, 1.0) && rejected < 100) ++rejected;
  EXPECT_LE(rejected, 60);
}

/// A filter that has followed a reduced eye at 20 mW for 100 ms, and the eye.
struct Followed {
  explicit Followed(double outlier_sigma)
      : filter(model_1khz(), {.outlier_sigma = outlier_sigma}), eye(model_1khz(), 1.0), draw(4) {
    for (int k = 0; k < 100; ++k) step(0.0);
  }
  UpdateStatus step(double offset) {
    eye.step(0.02);
    filter.predict(0.02);
    return filter.update(eye.outputs().volume + offset + 0.288 * draw.normal());
  }
  double peak_error() const { return filter.outputs().peak - eye.outputs().peak; }

  ExtendedKalmanFilter filter;
  ReducedPlant eye;
  Draw draw;
};

TEST(OutlierGate, ARejectedSampleIsAPredictionBitForBit) {
  Followed gated(6.0);
  Followed skipped(6.0);
  gated.eye.step(0.02);
  gated.filter.predict(0.02);
  skipped.filter.predict(0.02);
  EXPECT_EQ(gated.filter.update(60.0), UpdateStatus::kOutlier);
  EXPECT_TRUE(gated.filter.state() == skipped.filter.state());
  EXPECT_TRUE(gated.filter.covariance() == skipped.filter.covariance());
  EXPECT_EQ(gated.filter.absorption_factor(), skipped.filter.absorption_factor());
}

TEST(OutlierGate, AnOutlierDoesNoHarmBehindItAndDoesWithoutIt) {
  Followed gated(6.0);
  Followed open(0.0);
  EXPECT_EQ(gated.step(20.0), UpdateStatus::kOutlier);
  EXPECT_EQ(open.step(20.0), UpdateStatus::kUpdated);
  // The stated deviation of the peak is 0.1 K or so: 20 K of measurement error move an open filter
  // by many of them, a gated one not at all.
  EXPECT_LT(std::abs(gated.peak_error()), 4.0 * gated.filter.peak_sigma());
  EXPECT_GT(std::abs(open.peak_error()), 8.0 * open.filter.peak_sigma());
}

TEST(OutlierGate, AnHonestFilterIsNeverGated) {
  // 100,000 samples; a normal innovation beyond 6 sigma has a probability of 2e-9.
  int rejected = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    Draw draw(seed);
    ExtendedKalmanFilter filter(model_1khz(), {});
    ReducedPlant eye(model_1khz(), draw.between(0.35, 1.5));
    for (int k = 0; k < 250; ++k) {
      const double power = k < 5 ? 0.1 : 0.025;
      eye.step(power);
      filter.predict(power);
      const auto status = filter.update(eye.outputs().volume + 0.288 * draw.normal());
      rejected += status == UpdateStatus::kOutlier ? 1 : 0;
    }
  }
  EXPECT_EQ(rejected, 0);
}

TEST(OutlierGate, ALastingChangeOfTheMeasurementIsFollowed) {
  Followed gated(6.0);
  int rejected = 0;
  for (int k = 0; k < 200; ++k) rejected += gated.step(5.0) == UpdateStatus::kOutlier ? 1 : 0;
  // 5 K are 17 standard deviations of a sample: two samples at first, and some more where the
  // innovation shrinks past 6, since noise takes it in and out there. One in five would be many.
  EXPECT_GE(rejected, 2);
  EXPECT_LE(rejected, 40);
  const double innovation = gated.filter.innovation();
  EXPECT_LT(std::abs(innovation), 6.0 * gated.filter.innovation_sigma());
}

TEST(OutlierGate, TenSecondsWithoutLightNeitherTeachNorForget) {
  // alpha is not observable: its estimate stays where the prior has it, its deviation too.
  double moved = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    ExtendedKalmanFilter filter(model_1khz(), {});
    Draw draw(seed);
    for (int k = 0; k < 10000; ++k) {
      filter.predict(0.0);
      ASSERT_EQ(filter.update(0.288 * draw.normal()), UpdateStatus::kUpdated);
      // The unknown power of the tuning, scaled by alpha, is taken for a little information.
      ASSERT_GT(filter.absorption_sigma(), 0.8 * 0.25) << k;
      ASSERT_LT(filter.absorption_sigma(), 1.05 * 0.25) << k;
      ASSERT_LT(filter.peak_sigma(), 1.0) << k;
    }
    moved += std::pow(filter.absorption_factor() - 0.7363, 2) / 10.0;
  }
  // Half a standard deviation of the prior, root mean square.
  EXPECT_LT(std::sqrt(moved), 0.125);
}

}  // namespace
}  // namespace photocoag::testing
