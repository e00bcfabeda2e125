// The limit that holds with a stated probability.
#include <gtest/gtest.h>

#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/mpc/chance.hpp"
#include "support/heap_guard.hpp"
#include "support/uncertain_eyes.hpp"

namespace photocoag::testing {
namespace {

ControlSettings by_chance(double probability) {
  ControlSettings control;
  control.robust = Robustness::kChance;
  control.limit_probability = probability;
  control.power_max = 1.0;  // so that nothing but the limit holds the first power back
  return control;
}

TEST(NormalQuantile, IsTheTables) {
  EXPECT_NEAR(normal_quantile(0.5), 0.0, 1e-12);
  EXPECT_NEAR(normal_quantile(0.025), 1.959963984540054, 1e-12);
  EXPECT_NEAR(normal_quantile(1e-6), 4.753424308822899, 1e-10);
}

TEST(ChanceLimit, KeepsTheQuantileOfTheNextPeakBelowTheLimit) {
  // The next peak over draws from the belief, at the power that the controller chooses first: as
  // many exceed the limit as a normal distribution has beyond kappa.
  Controller controller(model_of_seven(), by_chance(0.2), believing());
  const ChanceLimit limit(*seven_quantity_model(), by_chance(0.2));
  const double power = controller.decide().power;
  const Eigen::MatrixXd root = *cholesky(seven_quantities().covariance_matrix());
  StateVector decay, gain, peak, volume;
  ResidueSlopes slope;
  const UncertainModel& model = *seven_quantity_model();
  model.step_of(model.period, decay, gain);
  constexpr int kDraws = 20000;
  int over = 0;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::VectorXd score(7);
    for (int q = 0; q < 7; ++q) {
      score[q] = standard_normal(21, static_cast<std::uint64_t>(i * 7 + q), RandomStream::kTest);
    }
    QuantityVector logs =
        Eigen::Map<const Eigen::VectorXd>(seven_quantities().mean.data(), 7) + root * score;
    model.evaluate(logs, peak, slope, volume, slope);
    over += peak.dot(gain) * power > 32.0 ? 1 : 0;
  }
  const double expected = 0.5 * std::erfc(limit.kappa() / std::sqrt(2.0));
  // The logarithm of the peak is not quite normal, nor linear; the box cuts the tail.
  EXPECT_LE(static_cast<double>(over) / kDraws, 1.3 * expected);
  EXPECT_GE(static_cast<double>(over) / kDraws, 0.3 * expected);
}

TEST(ChanceLimit, ASmallerProbabilityIsALowerPower) {
  double before = 1.0;
  for (const double probability : {0.5, 0.1, 1e-2, 1e-3, 1e-6}) {
    Controller controller(model_of_seven(), by_chance(probability), believing());
    const double power = controller.decide().power;
    EXPECT_LE(power, before) << probability;  // the reference may be what holds it back
    EXPECT_GT(power, 0.0);
    before = power;
  }
  EXPECT_LT(before, 0.5 * Controller(model_of_seven(), by_chance(0.5), believing()).decide().power);
}

TEST(ChanceLimit, KnowledgeBringsThePeakCloserToTheLimit) {
  // The same eye, told of more or less: with a prior a tenth as wide, the held peak is higher.
  const auto held = [](double width) {
    EstimatorSettings settings = believing();
    for (double& c : settings.prior.covariance) c *= width * width;
    Controller controller(model_of_seven(), by_chance(1e-3), settings);
    StateVector decay, gain, peak, volume;
    ResidueSlopes slope;
    const UncertainModel& model = *seven_quantity_model();
    model.step_of(model.period, decay, gain);
    QuantityVector logs = Eigen::Map<const Eigen::VectorXd>(seven_quantities().mean.data(), 7);
    model.evaluate(logs, peak, slope, volume, slope);
    StateVector x = StateVector::Zero(model.order());
    for (int k = 0; k < 100; ++k) {
      const double power = controller.decide().power;
      x = decay.cwiseProduct(x) + gain * power;
      controller.observe({std::exp(logs[6]) * volume.dot(x), power});
    }
    return peak.dot(x);
  };
  const double much = held(1.0);
  const double little = held(0.1);
  EXPECT_LT(much, 29.0);
  EXPECT_NEAR(little, 30.0, 0.05);
}

TEST(ChanceLimit, AWholeStepAllocatesNothing) {
  Controller controller(model_of_seven(), by_chance(1e-3), believing());
  HeapUse used;
  {
    const HeapGuard guard;
    controller.decide();
    for (int k = 0; k < 50; ++k) controller.step({10.0 + 0.1 * k, 0.03});
    used = guard.use();
  }
  EXPECT_EQ(used, HeapUse{});
}

TEST(ChanceLimit, NeedsAPosterior) {
  EstimatorSettings plain;
  EXPECT_THROW(Controller(model_of_seven(), by_chance(1e-3), plain), Error);
}

TEST(Identification, StartsGentlyForItsTimeOrUntilThePeakIsKnown) {
  ControlSettings control = by_chance(1e-3);
  control.identification_duration = 5e-3;
  control.identification_power = 0.01;
  Controller controller(model_of_seven(), control, believing());
  EXPECT_EQ(controller.decide().power, 0.01);
  for (int k = 1; k < 5; ++k) EXPECT_EQ(controller.step({4.0, 0.01}).power, 0.01) << k;
  EXPECT_GT(controller.step({4.0, 0.01}).power, 0.01);

  control.identification_sigma = 29.0;  // known well enough from the start
  Controller at_once(model_of_seven(), control, believing());
  at_once.decide();
  EXPECT_GT(at_once.step({4.0, 0.01}).power, 0.01);
}

}  // namespace
}  // namespace photocoag::testing
