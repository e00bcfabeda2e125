// The moving horizon estimator: the Kalman filter where everything is linear, its derivatives; two
// unknowns. What every estimator does with bounds, bad samples and the heap:
// every_estimator_test.cpp.
#include "photocoag/estimation/mhe.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "estimation/test_models.hpp"
#include "estimation/two_unknowns_model.hpp"
#include "photocoag/estimation/ekf.hpp"

namespace photocoag::testing {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// B and C_vol that do not depend on alpha: the problem is linear.
ReducedModel linear_model() {
  ReducedModel model = model_1khz();
  ParametricMatrices at;
  model.evaluate(0.7363, at);
  model.theta = Theta{};
  model.theta.kind = ThetaKind::kTaylor;
  model.theta.terms = 1;
  model.B_d.resize(model.order(), 1);
  model.B_d.col(0) = at.input;
  model.C_volume.resize(1, model.order());
  model.C_volume.row(0) = at.volume.transpose();
  return model;
}

TEST(MovingHorizon, IsTheKalmanFilterWhereEverythingIsLinear) {
  const ReducedModel model = linear_model();
  for (const int window : {2, 7, 20, 50}) {
    const EstimatorSettings settings{.window = window};
    ExtendedKalmanFilter filter(model, settings);
    MovingHorizonEstimator mhe(model, settings);
    ReducedPlant plant(model, 1.0);
    Draw draw(3);
    for (int k = 0; k < 150; ++k) {
      const double power = draw.between(0.0, 0.05);
      plant.step(power + 4e-4 * draw.normal());
      filter.predict(power);
      mhe.predict(power);
      const double sample =
          draw.chance(0.1) ? kNaN : plant.outputs().volume + 0.288 * draw.normal();
      ASSERT_EQ(filter.update(sample), mhe.update(sample));
      // Rounding: sums over the window instead of recursions, 1e-15 of 30 K times a few hundred.
      ASSERT_NEAR(mhe.outputs().peak, filter.outputs().peak, 1e-10) << window << ", " << k;
      ASSERT_NEAR(mhe.outputs().volume, filter.outputs().volume, 1e-10) << window << ", " << k;
      ASSERT_NEAR(mhe.peak_sigma(), filter.peak_sigma(), 1e-8) << window << ", " << k;
      ASSERT_NEAR(mhe.innovation(), filter.innovation(), 1e-10);
      ASSERT_NEAR(mhe.innovation_sigma(), filter.innovation_sigma(), 1e-10);
    }
  }
}

TEST(MovingHorizon, GradientsAreDifferencesOfThePrediction) {
  const auto mhe = followed<MovingHorizonEstimator>({}, 1.1, 40);
  for (const int j : {0, 5, 19}) {
    const ExtendedVector gradient = mhe.measurement_gradient(j);
    for (int i = 0; i < gradient.size(); ++i) {
      // Fourth-order difference; linear in x. alpha: truncation 1e-12, rounding 1e-14 / 1e-3.
      const double h = 1e-3;
      const auto value = [&](double steps) {
        ExtendedVector z = mhe.start();
        z[i] += steps * h;
        return mhe.predicted_volume(z, j);
      };
      const double difference =
          (8.0 * (value(1) - value(-1)) - (value(2) - value(-2))) / (12.0 * h);
      ASSERT_NEAR(gradient[i], difference, 1e-9 * std::max(1.0, std::abs(difference)))
          << "period " << j << ", unknown " << i;
    }
  }
}

template <typename E>
double final_error(const EstimatorSettings& settings, double alpha, double beta,
                   std::uint64_t seed) {
  E estimator(model_with_beta(), settings);
  ReducedPlant plant(model_with_beta(), {alpha, beta});
  Draw draw(seed);
  for (int k = 0; k < 1500; ++k) {
    const double power = k % 300 < 200 ? 0.04 : 0.0;
    plant.step(power);
    estimator.predict(power);
    estimator.update(plant.outputs().volume + 0.288 * draw.normal());
    EXPECT_GE(estimator.choroid_factor(), settings.choroid_min);
    EXPECT_LE(estimator.choroid_factor(), settings.choroid_max);
  }
  EXPECT_NEAR(estimator.absorption_factor(), alpha, 5.0 * estimator.absorption_sigma());
  EXPECT_NEAR(estimator.choroid_factor(), beta, 5.0 * estimator.choroid_sigma());
  EXPECT_LT(estimator.choroid_sigma(), 0.2 * settings.choroid_sigma_initial);
  return estimator.choroid_factor() - beta;
}

TEST(TwoUnknowns, BothEstimatorsFindAlphaAndBetaOfAMatchedEye) {
  const EstimatorSettings settings{.power_process_noise = 1e-5,
                                   .unknowns = Unknowns::kRpeAndChoroid};
  for (const double beta : {0.7, 1.0, 1.4}) {
    final_error<ExtendedKalmanFilter>(settings, 0.9, beta, 3);
    final_error<MovingHorizonEstimator>(settings, 0.9, beta, 3);
  }
}

TEST(TwoUnknowns, GradientsAndCovarianceAreConsistent) {
  EstimatorSettings settings{.unknowns = Unknowns::kRpeAndChoroid};
  MovingHorizonEstimator mhe(model_with_beta(), settings);
  for (int k = 0; k < 30; ++k) {
    mhe.predict(0.03);
    mhe.update(5.0 + 0.2 * k);
  }
  ASSERT_EQ(mhe.covariance().rows(), model_with_beta().order() + 2);
  for (int i = 0; i < mhe.start().size(); ++i) {
    const double h = 1e-3;
    const auto value = [&](double steps) {
      ExtendedVector z = mhe.start();
      z[i] += steps * h;
      return mhe.predicted_volume(z, 12);
    };
    const double difference = (8.0 * (value(1) - value(-1)) - (value(2) - value(-2))) / (12.0 * h);
    EXPECT_NEAR(mhe.measurement_gradient(12)[i], difference,
                1e-9 * std::max(1.0, std::abs(difference)))
        << i;
  }
}

TEST(TwoUnknowns, AModelWithOneParameterIsRefused) {
  const EstimatorSettings settings{.unknowns = Unknowns::kRpeAndChoroid};
  EXPECT_THROW(ExtendedKalmanFilter(model_1khz(), settings), std::exception);
  EXPECT_THROW(MovingHorizonEstimator(model_1khz(), settings), std::exception);
}

TEST(TwoUnknowns, TheBoxHasTheMostLikelyPoint) {
  // Against a scan of the box, for means in and out of it and covariances of either sign.
  const ParameterBox box{{0.2, 0.4}, {2.0, 2.5}};
  Draw draw(5);
  for (int trial = 0; trial < 200; ++trial) {
    const double s = draw.between(0.05, 1.0);
    const double t = draw.between(0.05, 1.0);
    const double c = draw.between(-0.95, 0.95) * s * t;
    const double V[2][2] = {{s * s, c}, {c, t * t}};
    const Parameters mean{draw.between(-1.0, 3.0), draw.between(-1.0, 4.0)};
    const auto cost = [&](double a, double b) {
      const double x = a - mean[0];
      const double y = b - mean[1];
      return (V[1][1] * x * x - 2.0 * c * x * y + V[0][0] * y * y) / (V[0][0] * V[1][1] - c * c);
    };
    const BoxedParameters boxed = keep_inside(mean, V, 2, box);
    double least = 1e300;
    for (int i = 0; i <= 100; ++i) {
      for (int j = 0; j <= 100; ++j) {
        least = std::min(least, cost(0.2 + 0.018 * i, 0.4 + 0.021 * j));
      }
    }
    ASSERT_LE(cost(boxed.value[0], boxed.value[1]), least * (1.0 + 1e-9) + 1e-12) << trial;
  }
}

}  // namespace
}  // namespace photocoag::testing
