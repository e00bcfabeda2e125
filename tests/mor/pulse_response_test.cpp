// The full-order model's modes after one period of power.
#include "photocoag/mor/pulse_response.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/fom/stepper.hpp"

namespace photocoag {
namespace {

using Eigen::VectorXd;

// Dropping modes for good changes nothing: against the stepper that keeps every mode.
TEST(PulseResponse, IsTheSteppersWithoutPower) {
  for (const auto how : {Discretization::kZeroOrderHold, Discretization::kImplicitEuler}) {
    const auto full =
        std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 2000});
    PulseResponse pulse(
        {.rates = full->axial().rates.replicate(1, full->radial().size()).rowwise() +
                  full->radial().rates.transpose(),
         .axis_weight = full->peak_radial().cwiseProduct(full->beam()),
         .spot_weight = full->beam().cwiseAbs2()},
        how, 1e-3);
    ModalStepper stepper(full, how, 1e-3, 0.0);
    stepper.step(1.0);
    VectorXd axis_sum = VectorXd::Zero(full->axial().size());
    for (int k = 1; k <= 400; ++k) {
      const double size = stepper.axis_profile().cwiseAbs().maxCoeff();
      EXPECT_LT((pulse.profiles().axis - stepper.axis_profile()).cwiseAbs().maxCoeff(),
                1e-13 * size);
      EXPECT_LT((pulse.profiles().spot - stepper.spot_profile()).cwiseAbs().maxCoeff(),
                1e-13 * stepper.spot_profile().maxCoeff());
      EXPECT_EQ(pulse.profiles().spot.tail(full->axial().size() - pulse.active()).sum(), 0.0);
      axis_sum += pulse.profiles().axis;
      pulse.advance();
      stepper.step(0.0);
    }
    const VectorXd all = pulse.sum_after(0.0).axis;
    EXPECT_LT((axis_sum + pulse.sum_after(400.0).axis - all).norm(), 1e-10 * all.norm());
  }
}

}  // namespace
}  // namespace photocoag
