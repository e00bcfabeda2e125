// What a Galerkin projection of a symmetric model must keep, whatever its basis.
#include "photocoag/mor/reduce.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/impulse_space.hpp"
#include "photocoag/mor/pod.hpp"
#include "photocoag/rom/file.hpp"
#include "support/thrown.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::shared_ptr<const FullOrderModel> model_of(const Tissue& tissue, std::size_t cells = 5000) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = cells});
}

ReducedModel reduced(const std::shared_ptr<const FullOrderModel>& full, int order = 6,
                     double period = 1e-3, Discretization how = Discretization::kZeroOrderHold) {
  return reduce(full, {.order = order}, period, how);
}

TEST(Reduce, KeepsSymmetryAndStability) {
  for (const auto& [name, tissue] : testing::various_tissues()) {
    SCOPED_TRACE(name);
    if (name == "single layer" || tissue.peak_layer != "RPE") continue;  // refused, see below
    const auto full = model_of(tissue, 3000);
    const ReducedModel model = reduced(full);
    ASSERT_EQ(model.order(), 6);
    const MatrixXd A = model.A;
    EXPECT_EQ(A, MatrixXd(A.diagonal().asDiagonal()));
    EXPECT_LT(A.diagonal().maxCoeff(), 0.0);
    // Rayleigh quotients: nothing decays slower than the full model's slowest mode.
    const double slowest = full->radial().rates[0] + full->axial().rates[0];
    EXPECT_LE(A.diagonal().maxCoeff(), -slowest * (1.0 - 1e-9));
    // The volume output is the input's adjoint: B_j = input_gain * C_j'.
    EXPECT_LT(
        (MatrixXd(model.B) - full->input_gain() * MatrixXd(model.C_volume).transpose()).norm(),
        1e-15 * MatrixXd(model.B).norm());
    EXPECT_GE(model.C_peak.minCoeff(), 0.0);
    EXPECT_EQ(model.tissue, tissue);
    EXPECT_EQ(model.full_order_states, full->states());
    EXPECT_NO_THROW(verify(model));
  }
}

// Behind much of what alpha scales, more alpha means less light: there the peak falls with alpha,
// and the controller's models may not.
TEST(Reduce, RefusesAPeakThatFallsWithAlpha) {
  Tissue deep;
  deep.peak_layer = "choroid";
  Tissue thick;
  thick.layers = {{"RPE", 300e-6, 5000.0, ScaledBy::kAlpha}};
  for (const Tissue& tissue : {deep, thick}) {
    EXPECT_EQ(testing::thrown_by([&] { reduced(model_of(tissue, 3000)); }).key, "C_peak");
  }
}

// For a symmetric model the volume's steady gain c'(-A)^-1 c is the largest value of 2 c'x + x'Ax:
// a projection finds at most that, and a larger space finds more.
TEST(Reduce, VolumeSteadyGainGrowsTowardTheFullModels) {
  const auto full = model_of(Tissue{});
  const double alpha = 0.9;
  const OutputWeights weights = full->output_weights(alpha);
  ModalStepper stepper(full, Discretization::kZeroOrderHold, 100.0, 0.0);
  stepper.step(1.0);
  const double exact = stepper.outputs(weights).volume;
  double last = 0.0;
  for (const int order : {1, 2, 4, 6, 8, 10, 12, 14}) {
    const ReducedModel model = reduce(full, {.order = order, .refinement = Refinement::kNone}, 1e-3,
                                      Discretization::kZeroOrderHold);
    VectorXd theta(model.terms());
    for (int j = 0; j < model.terms(); ++j) theta[j] = model.theta.points[j].evaluate(alpha).value;
    const VectorXd b = MatrixXd(model.B) * theta;
    const VectorXd c = MatrixXd(model.C_volume).transpose() * theta;
    const double gain = -c.dot(b.cwiseQuotient(VectorXd(model.A.diagonal())));
    // DEIM replaces the source by one that differs by some 1e-6.
    EXPECT_LE(gain, exact * (1.0 + 1e-5)) << order;
    EXPECT_GE(gain, last * (1.0 - 1e-12)) << order;
    last = gain;
  }
  // The basis is made for 400 ms, at which the gain is still 6 % away from its end.
  EXPECT_NEAR(last / exact, 1.0, 0.01);
}

// The reduced model against the same projection with the exact B(alpha) and C_vol(alpha) in place
// of DEIM's.
TEST(Reduce, DeimAddsNextToNothing) {
  for (const Tissue& tissue : {Tissue{}, testing::literature_choroid()}) {
    const auto full = model_of(tissue, 20000);
    const ReducedModel model =
        reduce(full, {.refinement = Refinement::kNone}, 1e-3, Discretization::kZeroOrderHold);
    // The alphas of reduce(); the space they span is the same to 1e-5 for any such choice.
    std::vector<AbsorptionFactors> alphas;
    for (int i = 0; i < 8; ++i) alphas.emplace_back(0.25 * std::pow(8.0, i / 7.0));
    const ImpulseSpace space = impulse_space(*full, alphas);
    const MatrixXd basis = pod_basis(*full, space, model.order());
    ReducedModel exact =
        model;  // one term, the constant 1 as an "absorbed fraction": exp(0) - exp(-1000)
    exact.theta = {.points = {AbsorbedFraction{.fixed_back = 1000.0}}, .terms = 1};
    exact.A = basis.transpose() * (-space.rates).asDiagonal() * basis;
    exact.C_peak = basis.transpose() * space.peak;
    double worst = 0.0;
    for (const double alpha : {0.2, 0.3, 0.5, 0.7363, 1.1, 1.4, 1.7, 2.0}) {
      const VectorXd shape = basis.transpose() * space.axial_source * full->axial_source(alpha);
      exact.B = full->input_gain() * shape;
      exact.C_volume = shape.transpose();
      exact.discretize(1e-3, Discretization::kZeroOrderHold);
      ReducedPlant with_deim(model, alpha);
      ReducedPlant without(exact, alpha);
      Outputs error;
      Outputs value;
      for (const double u : on_off_power(0.4, 1e-3, 10e-3, 9)) {
        with_deim.step(u);
        without.step(u);
        error.peak =
            std::max(error.peak, std::abs(with_deim.outputs().peak - without.outputs().peak));
        error.volume =
            std::max(error.volume, std::abs(with_deim.outputs().volume - without.outputs().volume));
        value.peak = std::max(value.peak, without.outputs().peak);
        value.volume = std::max(value.volume, without.outputs().volume);
      }
      worst = std::max({worst, error.peak / value.peak, error.volume / value.volume});
    }
    EXPECT_LT(worst, 1e-5);
  }
}

TEST(Reduce, IsDeterministic) {
  // Two models built from nothing: no state may leak from one to the next.
  const std::string first = to_json(reduced(model_of(Tissue{}, 20000)));
  const std::string second = to_json(reduced(model_of(Tissue{}, 20000)));
  EXPECT_EQ(first, second);
}

TEST(Reduce, ReportsItsProgress) {
  double last = -1.0;
  std::string stages;
  reduce(model_of(Tissue{}, 1000), {}, 4e-3, Discretization::kZeroOrderHold,
         [&](std::string_view stage, double fraction) {
           EXPECT_GE(fraction, last);
           EXPECT_LE(fraction, 1.0);
           last = fraction;
           stages += stage;
         });
  EXPECT_EQ(last, 1.0);
  EXPECT_NE(stages.find("measuring its error"), std::string::npos);
}

TEST(Reduce, RefusesOrdersThatDoNotExist) {
  const auto full = model_of(Tissue{}, 1000);
  for (const int order : {-1, 0, 15}) {
    EXPECT_EQ(testing::thrown_by([&] { reduced(full, order); }).key, "model.order") << order;
  }
}

TEST(OnOffPower, SwitchesAtWholePeriodsWithTheMeanDwellAskedFor) {
  const double period = 1e-3;
  const std::vector<double> power = on_off_power(100.0, period, 10e-3, 5);
  ASSERT_EQ(power.size(), 100000U);
  EXPECT_EQ(power.front(), 1.0);
  std::size_t switchings = 0;
  for (std::size_t i = 0; i < power.size(); ++i) {
    ASSERT_TRUE(power[i] == 0.0 || power[i] == 1.0);
    switchings += i > 0 && power[i] != power[i - 1] ? 1 : 0;
  }
  // Mean of ceil(t / h) for t exponential with mean m: 1 / (1 - exp(-h / m)) = 10.5 periods; about
  // 9500 dwells, so the mean is known to 1 %.
  EXPECT_NEAR(100000.0 / static_cast<double>(switchings + 1), 10.508, 0.35);
  EXPECT_EQ(power, on_off_power(100.0, period, 10e-3, 5));
  EXPECT_NE(power, on_off_power(100.0, period, 10e-3, 6));
}

}  // namespace
}  // namespace photocoag
