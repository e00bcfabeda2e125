// The model of several uncertain quantities against the full-order model it is made from.
#include <gtest/gtest.h>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/stepper.hpp"
#include "support/reduced_models.hpp"
#include "support/tissues.hpp"
#include "support/uncertain_eyes.hpp"

namespace photocoag::testing {
namespace {

TEST(StepResponseOf, IsThatOfTheStepper) {
  const auto full = coarse_full_model();
  std::vector<double> times;
  for (int k = 1; k <= 40; ++k) times.push_back(k * 2e-3);
  const StepResponse response = step_response_of(*full, 0.8, times);
  FullOrderPlant plant(full, Discretization::kZeroOrderHold, 2e-3, {0.8, 1.0});
  for (Eigen::Index k = 0; k < response.peak.size(); ++k) {
    plant.step(1.0);
    // The quadrature's error: five points on intervals of one octave.
    EXPECT_NEAR(response.peak[k], plant.outputs().peak, 1e-5 * plant.outputs().peak);
    EXPECT_NEAR(response.volume[k], plant.outputs().volume, 1e-5 * plant.outputs().volume);
  }
}

TEST(UncertainFit, FollowsAnEyeOfItsOwnGridUnderChangingPower) {
  const UncertainModel& model = *seven_quantity_model();
  const QuantityVector logs = logs_at({0.7, 0.2, 0.6, 0.8, 0.4, 0.3, 0.5});
  Tissue eye;
  for (Eigen::Index q = 0; q < logs.size(); ++q) {
    eye = with_quantity(eye, model.quantities[static_cast<std::size_t>(q)], std::exp(logs[q]));
  }
  eye.transmission = std::exp(logs[4]);
  const auto full = std::make_shared<const FullOrderModel>(eye, GridSettings{.min_cells = 20000});
  FullOrderPlant plant(full, Discretization::kZeroOrderHold, 1e-3, {std::exp(logs[0]), 1.0});
  StateVector decay;
  StateVector gain;
  model.step_of(1e-3, decay, gain);
  StateVector peak;
  StateVector volume;
  ResidueSlopes peak_slope;
  ResidueSlopes volume_slope;
  model.evaluate(logs, peak, peak_slope, volume, volume_slope);
  StateVector x = StateVector::Zero(model.order());
  double highest = 0.0;
  for (int k = 0; k < 300; ++k) {
    const double power = k % 50 < 30 ? 0.05 : 0.01;
    x = decay.cwiseProduct(x) + gain * power;
    plant.step(power);
    highest = std::max(highest, plant.outputs().peak);
    // Fit and coarse grid together; another grid than the fit's.
    EXPECT_NEAR(peak.dot(x), plant.outputs().peak, 0.01 * highest) << k;
    EXPECT_NEAR(volume.dot(x), plant.outputs().volume, 0.015 * highest) << k;
  }
}

TEST(UncertainFit, ErrorsAreMeasuredAndSmall) {
  const UncertainModel& model = *seven_quantity_model();
  EXPECT_GT(model.peak_error_rms, 0.0);
  EXPECT_LT(model.peak_error_rms, 1.5e-3);
  EXPECT_GE(model.peak_error_max, model.peak_error_rms);
  EXPECT_GT(model.volume_error_rms, 0.0);
  EXPECT_LT(model.volume_error_rms, 4e-3);
  EXPECT_GE(model.volume_error_max, model.volume_error_rms);
}

TEST(UncertainFit, TheSameArgumentsGiveTheSameBits) {
  const UncertainModel again =
      fit_uncertain_model(Tissue(), coarse_grid(), seven_quantities(), 1e-3);
  EXPECT_EQ(again.peak, seven_quantity_model()->peak);
  EXPECT_EQ(again.volume, seven_quantity_model()->volume);
}

TEST(UncertainFit, RefusesWhatItCannotCarry) {
  EXPECT_THROW(fit_uncertain_model(layered(), coarse_grid(), seven_quantities(), 1e-3), Error);
  Belief elsewhere = seven_quantities();
  elsewhere.quantities[1].layer = "nowhere";
  EXPECT_THROW(fit_uncertain_model(Tissue(), coarse_grid(), elsewhere, 1e-3), Error);
}

}  // namespace
}  // namespace photocoag::testing
