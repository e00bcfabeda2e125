// Temperatures of reduced states: consistent with the outputs, and close to the full-order field.
#include <gtest/gtest.h>

#include <memory>

#include "photocoag/fom/layered_stepper.hpp"
#include "photocoag/fom/sparse_system.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/reconstruct.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kAlpha = 1.1;
constexpr double kPeriod = 1e-3;

VectorXd state_after(const ReducedModel& model, int steps) {
  ParametricMatrices matrices;
  model.evaluate(kAlpha, matrices);
  VectorXd state = VectorXd::Zero(model.order());
  for (int k = 0; k < steps; ++k) {
    state = (model.A_d * state + matrices.input * 0.03).eval();
  }
  return state;
}

TEST(Reconstruct, GivesThePeakThatTheReducedModelGives) {
  const auto full =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 5000});
  for (const ReductionMethod method :
       {ReductionMethod::kPodDeim, ReductionMethod::kBalancedTwoSided}) {
    const ReconstructingModel reduced =
        reconstructing_model(*full, {.method = method, .refinement = Refinement::kNone}, kPeriod,
                             Discretization::kZeroOrderHold);
    const VectorXd state = state_after(reduced.model, 20);
    const MatrixXd cells = reconstruct(*full, reduced, state);
    // C_peak V x in two orders of summation; V is orthonormal to 1e-8 only.
    const double peak = reduced.model.C_peak.dot(state);
    EXPECT_NEAR(peak_of_cells(*full).dot(cells.reshaped()), peak, 1e-7 * peak);
  }
}

TEST(Reconstruct, IsCloserToTheFullFieldWithMoreStates) {
  const auto full =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 5000});
  ModalStepper stepper(full, Discretization::kZeroOrderHold, kPeriod);
  for (int k = 0; k < 20; ++k) stepper.step(0.03);
  const MatrixXd reference = stepper.temperatures(kAlpha);
  for (const Refinement refinement : {Refinement::kNone, Refinement::kOutputError}) {
    SCOPED_TRACE(to_string(refinement));
    double last = 1.0;
    for (const int order : {2, 6, 12}) {
      const ReconstructingModel reduced =
          reconstructing_model(*full, {.order = order, .refinement = refinement}, kPeriod,
                               Discretization::kZeroOrderHold);
      const MatrixXd cells = reconstruct(*full, reduced, state_after(reduced.model, 20));
      const double error = (cells - reference).cwiseAbs().maxCoeff() / reference.maxCoeff();
      EXPECT_LT(error, 0.75 * last);
      last = error;
    }
    EXPECT_LT(last, 0.02) << "order 12, worst cell; outputs are far more exact than single cells";
  }
}

TEST(Reconstruct, WorksWhereNothingSeparates) {
  const auto full =
      std::make_shared<const FullOrderModel>(testing::layered(), GridSettings{.min_cells = 3000});
  LayeredStepper stepper(full, Discretization::kZeroOrderHold, kPeriod, kAlpha);
  for (int k = 0; k < 20; ++k) stepper.step(0.03);
  const MatrixXd reference = stepper.temperatures();
  const ReconstructingModel reduced =
      reconstructing_model(*full, {.order = 10}, kPeriod, Discretization::kZeroOrderHold);
  const MatrixXd cells = reconstruct(*full, reduced, state_after(reduced.model, 20));
  // As on uniform tissue: single cells are less exact than the outputs.
  EXPECT_LT((cells - reference).cwiseAbs().maxCoeff(), 0.03 * reference.maxCoeff());
}

}  // namespace
}  // namespace photocoag
