// The limit with a margin: an upper bound indeed, and what it is for.
#include "photocoag/mpc/robust.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "loop/treatments.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/population/spots.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Config config_of(const std::vector<std::string>& overrides) { return load_config("", overrides); }

// Any state and alpha within robust_sigma deviations (of the peak's direction, and of alpha), any
// powers: the reduced model's peak stays below what the limit's rows add up to. The margin for the
// model's own error is left out of the comparison by asking for no power applied so far and taking
// its share of the coming powers as room.
TEST(RobustLimit, IsAboveEveryPlausiblePeak) {
  const ReducedModel& model = default_models(1e-3).reduced();
  const ControlSettings settings{.horizon = 6, .robust = Robustness::kCertified};
  RobustLimit limit(model, settings, 2.0);
  const int n = model.order();
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit;
  ParametricMatrices matrices;
  model.evaluate(1.0, matrices);
  for (int repeat = 0; repeat < 200; ++repeat) {
    const double alpha = 0.4 + unit(generator);
    const double alpha_sigma = 0.1 * unit(generator);
    MatrixXd root(n + 1, n + 1);
    for (double& value : root.reshaped()) value = 1e-6 * normal(generator);
    const MatrixXd covariance = root * root.transpose();
    VectorXd mean(n);
    for (double& value : mean) value = 1e-4 * unit(generator);
    const LimitTightening& tightening = limit.tighten(covariance, {alpha, alpha_sigma}, false, 0.0);
    // A point of the ellipsoid of 4 deviations.
    VectorXd direction(n);
    for (double& value : direction) value = normal(generator);
    const VectorXd excess = covariance.topLeftCorner(n, n) * direction /
                            std::sqrt(direction.dot(covariance.topLeftCorner(n, n) * direction));
    VectorXd state = mean + 4.0 * excess;
    VectorXd estimate = mean;
    const double truth = std::min(alpha + 4.0 * alpha_sigma * (2.0 * unit(generator) - 1.0), 2.0);
    model.evaluate(truth, matrices);
    VectorXd powers(5);
    for (double& value : powers) value = 0.1 * unit(generator);
    MatrixXd A = model.A_d;
    VectorXd bound_state = estimate;
    for (int k = 0; k < 5; ++k) {
      state = A * state + VectorXd(matrices.input) * powers[k];
      bound_state = A * bound_state + VectorXd(tightening.input) * powers[k];
      double margin = tightening.free[k];
      for (int j = 0; j <= k; ++j) margin += tightening.impulse[k - j] * powers[j] / 0.1;
      const double peak = VectorXd(model.C_peak).dot(state);
      const double bound = VectorXd(model.C_peak).dot(bound_state) + margin;
      EXPECT_LE(peak, bound + 1e-9) << "stage " << k + 1;
      EXPECT_GE(tightening.impulse[k], 0.0);
      EXPECT_GE(tightening.free[k], 0.0);
    }
  }
}

TEST(RobustLimit, RemembersThePowersApplied) {
  const ReducedModel& model = default_models(1e-3).reduced();
  const ControlSettings settings{.horizon = 3, .robust = Robustness::kCertified};
  RobustLimit limit(model, settings, 2.0);
  const MatrixXd none = MatrixXd::Zero(model.order() + 1, model.order() + 1);
  RunningErrorBound running(*model.certificate);
  EXPECT_EQ(limit.tighten(none, {0.9, 0.0}, false, 0.0).free[0], 0.0);
  for (const double power : {0.1, 0.02, 0.03, 0.0, 0.03}) {
    limit.observe(power);
    running.step(power);
  }
  running.step(0.0);  // stage 1 is one period on, nothing applied
  // The bound at the estimate itself, between two nodes as well.
  for (const double alpha : {0.9, 0.913, 0.3, 1.7}) {
    const double free = limit.tighten(none, {alpha, 0.0}, false, 0.0).free[0];
    EXPECT_NEAR(free, running.bound(alpha).peak, 1e-12 * free) << alpha;
  }
}

// The certificate's scale is linear between nodes, where it is proved (docs/models.md): what is
// kept is the largest of all plausible alphas, no less and no more.
TEST(RobustLimit, KeepsTheLargestBoundOfThePlausibleAlphas) {
  const ReducedModel& model = default_models(1e-3).reduced();
  const ControlSettings settings{.horizon = 2, .robust = Robustness::kCertified};
  RobustLimit limit(model, settings, 3.0);
  RunningErrorBound running(*model.certificate);
  for (int k = 0; k < 50; ++k) {
    limit.observe(0.03);
    running.step(0.03);
  }
  running.step(0.0);
  const MatrixXd none = MatrixXd::Zero(model.order() + 1, model.order() + 1);
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> unit;
  for (int repeat = 0; repeat < 300; ++repeat) {
    const double alpha = 0.2 + 1.7 * unit(generator);
    const double sigma = std::pow(10.0, -4.0 + 3.0 * unit(generator));
    const double free = limit.tighten(none, {alpha, sigma}, false, 0.0).free[0];
    const double low = alpha - settings.robust_sigma * sigma;
    const double high = alpha + settings.robust_sigma * sigma;
    double largest = std::max(running.bound(low).peak, running.bound(high).peak);
    for (const double node : model.certificate->absorption_factors) {
      if (node >= low && node <= high) largest = std::max(largest, running.bound(node).peak);
    }
    for (int k = 0; k <= 200; ++k) {
      const double between = running.bound(low + (high - low) * k / 200).peak;
      ASSERT_GE(free, between * (1.0 - 1e-14)) << alpha << " +- " << sigma;
    }
    ASSERT_NEAR(free, largest, 1e-12 * largest) << alpha << " +- " << sigma;
  }
}

TEST(RobustLimit, NeedsACertificate) {
  ReducedModel model = default_models(1e-3).reduced();
  model.certificate.reset();
  EXPECT_THROW(RobustLimit(model, {.robust = Robustness::kCertified}, 2.0), Error);
}

// docs/control.md: without penalties 4 ms at 0.1 W bring an eye of alpha 1.5 to 45 K.
TEST(RobustControl, KeepsTheLimitAt250HzWithoutPenalties) {
  for (const std::string alpha : {"0.4", "1.1", "1.5"}) {
    const std::vector<std::string> plain{"control.period_ms=4", "run.duration_ms=200",
                                         "safety.supervisor=off",
                                         "plant.absorption_factor=" + alpha};
    std::vector<std::string> robust = plain;
    robust.push_back("control.robust=certified");
    const Outcome nominal = outcome(config_of(plain), treat(config_of(plain)).records);
    const Outcome guarded = outcome(config_of(robust), treat(config_of(robust)).records);
    EXPECT_EQ(nominal.violations > 0, alpha != "0.4") << alpha;
    EXPECT_EQ(guarded.violations, 0) << alpha;
    EXPECT_LT(guarded.rms, 0.3) << alpha;
    EXPECT_LE(guarded.time_to_95, 0.017) << alpha;
  }
}

TEST(RobustControl, AllocatesNothing) {
  const Config config = config_of({"control.robust=certified", "control.delay_cycles=1"});
  Controller controller(default_models(1e-3).reduced(), config.control, config.estimator);
  const HeapGuard guard;
  Decision decision = controller.decide();
  for (int k = 0; k < 20; ++k) {
    decision = controller.step({.volume_temperature = 0.5 * k, .applied_power = decision.power});
  }
  EXPECT_EQ(guard.use(), HeapUse{});
}

TEST(Spots, EachDependsOnItsSeedAlone) {
  const Config config = config_of({"grid.min_cells=2000", "uncertainty.thickness_relative=0.1"});
  const ReducedModel& model = default_models(1e-3).reduced();
  const auto five = treat_spots(config, model, {}, 32.0, 5);
  const auto three = treat_spots(config, model, {}, 32.0, 3);
  ASSERT_EQ(five.size(), 5U);
  for (std::size_t i = 0; i < three.size(); ++i) {
    EXPECT_EQ(five[i].alpha, three[i].alpha);
    EXPECT_EQ(five[i].peak_max, three[i].peak_max);
  }
  EXPECT_NE(five[0].alpha, five[1].alpha);
  EXPECT_GT(five[0].peak_max, 28.0);
}

}  // namespace
}  // namespace photocoag::testing
