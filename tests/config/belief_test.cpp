// [[prior]] as a Gaussian in logarithms.
#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/config/belief.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

constexpr const char* kEye = PHOTOCOAG_SOURCE_DIR "/configs/uncertain-eye.toml";

TEST(Belief, HasTheMomentsOfTheTruncatedDistribution) {
  Prior prior;
  prior.quantities = {{.key = "plant.tissue.transmission",
                       .distribution = Distribution::kUniform,
                       .low = 0.85,
                       .high = 1.0}};
  const Belief belief = belief_of(prior, {});
  // E ln q of a uniform q on [a, b]: (b ln b - a ln a) / (b - a) - 1.
  const double mean = -0.85 * std::log(0.85) / 0.15 - 1.0;
  EXPECT_NEAR(belief.mean[1], mean, 1e-7);
  // E ln^2 q: [q ln^2 q - 2 q ln q + 2 q] / (b - a).
  const auto antiderivative = [](double q) {
    return q * std::log(q) * std::log(q) - 2.0 * q * std::log(q) + 2.0 * q;
  };
  const double square = (antiderivative(1.0) - antiderivative(0.85)) / 0.15;
  EXPECT_NEAR(belief.covariance[3], square - mean * mean, 1e-7);
}

TEST(Belief, AlphaComesFirstAndFromTheEstimatorIfNotDeclared) {
  Prior prior;
  prior.quantities = {{.key = "calibration_factor",
                       .distribution = Distribution::kLogNormal,
                       .center = 1.0,
                       .spread = 0.03,
                       .low = 0.5,
                       .high = 2.0}};
  EstimatorSettings estimator;
  const Belief belief = belief_of(prior, estimator);
  ASSERT_EQ(belief.quantities.size(), 2u);
  EXPECT_EQ(belief.quantities[0].kind, QuantityKind::kAbsorptionFactor);
  EXPECT_EQ(belief.quantities[0].low, estimator.absorption_min);
  EXPECT_EQ(belief.quantities[1].kind, QuantityKind::kCalibration);
  EXPECT_NEAR(belief.mean[1], 0.0, 1e-9);
  EXPECT_NEAR(belief.covariance[3], 0.03 * 0.03, 1e-6);
}

TEST(Belief, CorrelationsAndTheNoiseAreCarried) {
  const Config config = load_config(kEye, {});
  const Belief& belief = config.estimator.prior;
  EXPECT_EQ(config.estimator.kind, EstimatorKind::kPosterior);
  ASSERT_EQ(belief.quantities.size(), 7u);
  const auto C = belief.covariance_matrix();
  EXPECT_NEAR(C(0, 2) / std::sqrt(C(0, 0) * C(2, 2)), 0.4, 1e-12);
  EXPECT_NEAR(belief.noise, 0.288, 0.002);
  EXPECT_NEAR(belief.noise_spread, 0.2, 0.002);
  EXPECT_EQ(belief.quantities[1].layer, "RPE");
  EXPECT_DOUBLE_EQ(belief.quantities[1].low, 4.5e-6);
  EXPECT_NO_THROW(belief.validate());
}

TEST(Belief, WithoutAPriorThereIsNone) {
  EXPECT_FALSE(belief_of({}, {}).declared());
  EXPECT_FALSE(load_config("", {}).estimator.prior.declared());
}

TEST(Belief, AResolvedConfigurationBelievesTheSame) {
  const Config config = load_config(kEye, {});
  const TemporaryFolder folder;
  const std::string printed = folder.file("resolved.toml");
  write_file(printed, to_toml(config));
  EXPECT_EQ(load_config(printed, {}), config);
  EXPECT_EQ(load_config(kEye, {"control.robust=none"}).estimator.kind, EstimatorKind::kEkf);
  EXPECT_EQ(load_config(kEye, {"control.robust=none", "estimator.kind=posterior"}).estimator.prior,
            config.estimator.prior);
}

TEST(Belief, WhatThePosteriorCannotServeIsRefused) {
  for (const char* option :
       {"estimator.kind=mhe", "model.discretization=implicit-euler", "control.solver=osqp",
        "estimator.sample_lag_periods=0.3", "estimator.sample_averaging_periods=1"}) {
    EXPECT_THROW(load_config(kEye, {option}), Error) << option;
  }
  EXPECT_THROW(load_config("", {"estimator.kind=posterior"}), Error);
}

}  // namespace
}  // namespace photocoag::testing
