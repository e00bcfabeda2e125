// One exam for every estimator: it finds alpha and knows its error, keeps its bounds, does not
// depend on the state's scale, and no sample or power can spoil it.
#include <gtest/gtest.h>

#include <cmath>
#include <exception>
#include <limits>
#include <type_traits>

#include "estimation/test_models.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/estimation/estimator.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <typename E>
bool same_bits(const E& a, const E& b) {
  return a.state() == b.state() && a.absorption_factor() == b.absorption_factor() &&
         a.covariance() == b.covariance() && a.matrices().input == b.matrices().input &&
         a.matrices().volume == b.matrices().volume;
}

template <typename E>
class EveryEstimator : public ::testing::Test {
 protected:
  /// It has seen 30 noisy samples of a reduced eye.
  static E warm(const EstimatorSettings& settings = {}) { return followed<E>(settings, 1.0, 30); }
};

using Estimators = ::testing::Types<ExtendedKalmanFilter, MovingHorizonEstimator>;
TYPED_TEST_SUITE(EveryEstimator, Estimators);

TYPED_TEST(EveryEstimator, FindsAlphaAndKnowsItsError) {
  for (const double alpha : {0.35, 0.6, 1.0, 1.5}) {
    const auto estimator = followed<TypeParam>({}, alpha, 200);
    EXPECT_NEAR(estimator.absorption_factor(), alpha, 5.0 * estimator.absorption_sigma()) << alpha;
    EXPECT_LT(estimator.absorption_sigma(), 0.03 * alpha);
  }
}

TYPED_TEST(EveryEstimator, StaysInsideItsBounds) {
  int at_bound = 0;
  for (const double alpha : {0.3, 1.6}) {
    TypeParam estimator(model_1khz(),
                        {.absorption_min = 0.6, .absorption_max = 0.9, .outlier_sigma = 0.0});
    ReducedPlant plant(model_1khz(), alpha);
    Draw draw(8);
    for (int k = 0; k < 200; ++k) {
      const double power = draw.between(0.0, 0.1);
      plant.step(power);
      estimator.predict(power);
      estimator.update(plant.outputs().volume + 0.288 * draw.normal());
      const double found = estimator.absorption_factor();
      ASSERT_GE(found, 0.6);
      ASSERT_LE(found, 0.9);
      at_bound += found == 0.6 || found == 0.9 ? 1 : 0;
      // The matrices in use are those of the bounded alpha.
      ParametricMatrices matrices;
      model_1khz().evaluate(found, matrices);
      ASSERT_TRUE(estimator.matrices().input == matrices.input);
      ASSERT_TRUE(estimator.matrices().volume_slope[0] == matrices.volume_slope[0]);
      if constexpr (std::is_same_v<TypeParam, MovingHorizonEstimator>) {
        ASSERT_LE(estimator.iterations(), MovingHorizonEstimator::kMaxIterations);
      }
    }
  }
  EXPECT_GT(at_bound, 100) << "the bounds hardly ever acted: the test tests nothing";
}

TYPED_TEST(EveryEstimator, DoesNotDependOnTheReducedStatesScale) {
  TypeParam plain(model_1khz(), {});
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    plain.reset();
    TypeParam scaled(rescaled(model_1khz(), seed), {});
    ReducedPlant plant(model_1khz(), 1.1);
    Draw draw(seed);
    for (int k = 0; k < 100; ++k) {
      const double power = draw.between(0.0, 0.05);
      plant.step(power);
      plain.predict(power);
      scaled.predict(power);
      const double sample = plant.outputs().volume + 0.288 * draw.normal();
      plain.update(sample);
      scaled.update(sample);
      // Rounding times the condition of the transformation.
      ASSERT_NEAR(scaled.absorption_factor(), plain.absorption_factor(), 1e-7) << k;
      ASSERT_NEAR(scaled.outputs().peak, plain.outputs().peak, 1e-6) << k;
    }
  }
}

TYPED_TEST(EveryEstimator, SameInputSameBits) {
  EXPECT_TRUE(same_bits(followed<TypeParam>({}, 0.9, 60), followed<TypeParam>({}, 0.9, 60)));
}

TYPED_TEST(EveryEstimator, AMissingSampleIsAPredictionBitForBit) {
  for (const double missing : {kNaN, -kNaN, kInfinity, -kInfinity}) {
    TypeParam with = this->warm();
    TypeParam without = with;
    for (int k = 0; k < 5; ++k) {
      with.predict(0.03);
      without.predict(0.03);
      EXPECT_EQ(with.update(missing), UpdateStatus::kNoSample);
      ASSERT_TRUE(same_bits(with, without));
    }
    // And the next sample is used as if nothing had happened.
    EXPECT_EQ(with.update(12.0), UpdateStatus::kUpdated);
    without.update(12.0);
    EXPECT_TRUE(same_bits(with, without));
  }
}

TYPED_TEST(EveryEstimator, NothingButGapsIsAPredictionAllAlong) {
  TypeParam estimator = this->warm();
  for (int k = 0; k < 100; ++k) {  // longer than any window
    estimator.predict(0.01);
    EXPECT_EQ(estimator.update(kNaN), UpdateStatus::kNoSample);
  }
  EXPECT_TRUE(std::isfinite(estimator.outputs().peak));
  EXPECT_TRUE(std::isfinite(estimator.peak_sigma()));
}

TYPED_TEST(EveryEstimator, PoisonedSamplesLeaveFiniteNumbers) {
  for (const double poison :
       {kNaN, 1e30, -1e30, 1e150, -1e150, 1e300, -1e300, 1.7e308, -1.7e308, -60.0, 299.0, -49.0}) {
    TypeParam estimator = this->warm();
    estimator.predict(0.02);
    estimator.update(poison);
    for (int k = 0; k < 60; ++k) {
      ASSERT_TRUE(estimator.state().allFinite()) << poison;
      ASSERT_TRUE(estimator.covariance().allFinite()) << poison;
      ASSERT_TRUE(estimator.matrices().input.allFinite()) << poison;
      ASSERT_GE(estimator.absorption_factor(), 0.2);
      ASSERT_LE(estimator.absorption_factor(), 2.0);
      ASSERT_TRUE(std::isfinite(estimator.absorption_sigma()));
      ASSERT_TRUE(std::isfinite(estimator.peak_sigma()));
      ASSERT_TRUE(std::isfinite(estimator.outputs().peak)) << poison;
      estimator.predict(0.02);
      estimator.update(10.0);
    }
  }
}

TYPED_TEST(EveryEstimator, ImpossibleSamplesAreMissingSamples) {
  // -1e6 K taken at face value keeps the laser at full power to the end of a treatment.
  for (const double impossible : {-50.1, -1000.0, -1e6, 300.1, 1e30, -1.7e308}) {
    TypeParam estimator = this->warm();
    estimator.predict(0.02);
    const TypeParam without = estimator;
    EXPECT_EQ(estimator.update(impossible), UpdateStatus::kNoSample) << impossible;
    EXPECT_TRUE(same_bits(estimator, without)) << impossible;
  }
  for (const double possible : {-49.9, 299.9}) {
    TypeParam estimator = this->warm({.outlier_sigma = 0.0});
    estimator.predict(0.02);
    EXPECT_EQ(estimator.update(possible), UpdateStatus::kUpdated) << possible;
  }
}

TYPED_TEST(EveryEstimator, ANonFinitePowerIsRestartedByTheNextSample) {
  TypeParam estimator = this->warm();
  estimator.predict(kNaN);
  EXPECT_EQ(estimator.update(10.0), UpdateStatus::kRestarted);
  const TypeParam fresh(model_1khz(), {});
  EXPECT_TRUE(same_bits(estimator, fresh));
}

TYPED_TEST(EveryEstimator, RefusesBadSettings) {
  EXPECT_THROW(TypeParam(model_1khz(), {.absorption_initial = 3.0}), std::exception);
  EXPECT_THROW(TypeParam(model_1khz(), {.measurement_noise = 0.0}), std::exception);
  EXPECT_THROW(TypeParam(model_1khz(), {.absorption_sigma_initial = kNaN}), std::exception);
}

TYPED_TEST(EveryEstimator, AllocatesNothing) {
  TypeParam estimator(model_1khz(), {.window = 50});
  double sum = 0.0;
  HeapUse use;
  {
    const HeapGuard guard;
    for (int k = 0; k < 120; ++k) {
      estimator.predict(0.03);
      estimator.update(k == 7 ? kNaN : k == 9 ? 1e300 : 5.0);
      sum += estimator.outputs().peak + estimator.peak_sigma() + estimator.absorption_sigma();
    }
    estimator.reset();
    use = guard.use();
  }
  EXPECT_EQ(use, HeapUse{});
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace photocoag::testing
