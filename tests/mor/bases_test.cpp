// What every reduction must keep, whatever spans its states.
#include "photocoag/mor/bases.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <memory>

#include "photocoag/mor/compare.hpp"
#include "photocoag/mor/reduce.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr ReductionMethod kMethods[] = {ReductionMethod::kPodDeim, ReductionMethod::kBalanced,
                                        ReductionMethod::kBalancedTwoSided, ReductionMethod::kIrka,
                                        ReductionMethod::kTaylor};

std::shared_ptr<const FullOrderModel> model_of(const Tissue& tissue, std::size_t cells = 5000) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = cells});
}

TEST(Bases, TestAndTrialAreBiorthonormal) {
  const auto full = model_of(Tissue{});
  const ImpulseSpace space = reduction_space(*full);
  const ParametricSource source = parametric_source(*full, ParameterDependence::kTaylor, 5);
  for (const ReductionMethod method : kMethods) {
    SCOPED_TRACE(to_string(method));
    for (const int order : {1, 6, 14}) {
      const Bases bases = make_bases(*full, space, method, order, source);
      ASSERT_EQ(bases.trial.cols(), order);
      // Balanced coordinates scale by the inverse root of Hankel singular values down to 1e-9.
      const MatrixXd identity = MatrixXd::Identity(order, order);
      EXPECT_LT((bases.test.transpose() * bases.trial - identity).cwiseAbs().maxCoeff(), 1e-6);
      EXPECT_EQ(bases.galerkin, method != ReductionMethod::kBalancedTwoSided);
    }
  }
}

TEST(Bases, EveryMethodIsStableOnEveryTissue) {
  for (const auto& [name, tissue] : testing::various_tissues()) {
    const auto full = model_of(tissue, 3000);
    const ImpulseSpace space = reduction_space(*full);
    for (const ReductionMethod method : kMethods) {
      SCOPED_TRACE(name + ", " + std::string(to_string(method)));
      const ReducedModel model =
          project_model(*full, space, {.method = method}, 1e-3, Discretization::kZeroOrderHold);
      const VectorXd real =
          Eigen::EigenSolver<MatrixXd>(MatrixXd(model.A), false).eigenvalues().real();
      EXPECT_LT(real.maxCoeff(), 0.0);
      if (method == ReductionMethod::kBalancedTwoSided) continue;
      // Galerkin: diagonal, the volume output is the input's adjoint, so the model is passive.
      EXPECT_EQ(MatrixXd(model.A), MatrixXd(model.A.diagonal().asDiagonal()));
      EXPECT_LT(
          (MatrixXd(model.B) - full->input_gain() * MatrixXd(model.C_volume).transpose()).norm(),
          1e-15 * MatrixXd(model.B).norm());
    }
  }
}

// Diagonal coordinates or not, it is the projection: the transfer function at a few frequencies is
// that of the bases before any change of coordinates.
TEST(Bases, CoordinatesDoNotChangeTheTransferFunction) {
  const auto full = model_of(Tissue{});
  const ImpulseSpace space = reduction_space(*full);
  const ParametricSource source = parametric_source(*full, ParameterDependence::kChebyshev, 8);
  for (const ReductionMethod method : kMethods) {
    SCOPED_TRACE(to_string(method));
    const ReductionSettings settings{.method = method,
                                     .order = 8,
                                     .parameter_dependence = ParameterDependence::kChebyshev,
                                     .refinement = Refinement::kNone};
    const ParametricSource own = method == ReductionMethod::kTaylor
                                     ? parametric_source(*full, ParameterDependence::kTaylor, 5)
                                     : source;
    const Bases bases = make_bases(*full, space, method, 8, own);
    const ReducedModel model =
        project_model(*full, space, settings, 1e-3, Discretization::kZeroOrderHold);
    const MatrixXd A = -(bases.test.transpose() * space.rates.asDiagonal() * bases.trial);
    TermVector theta;
    TermVector slope;
    model.theta.evaluate(0.9, theta, slope);
    const VectorXd shape = space.axial_source * own.sources * VectorXd(theta);
    for (const double s : {0.0, 30.0, 3000.0}) {
      const MatrixXd resolvent = s * MatrixXd::Identity(8, 8) - A;
      const VectorXd state =
          resolvent.partialPivLu().solve(full->input_gain() * bases.test.transpose() * shape);
      const MatrixXd resolvent_model = s * MatrixXd::Identity(8, 8) - MatrixXd(model.A);
      const VectorXd state_model =
          resolvent_model.partialPivLu().solve(MatrixXd(model.B) * VectorXd(theta));
      const double peak = space.peak.dot(bases.trial * state);
      const double volume = shape.dot(bases.trial * state);
      EXPECT_NEAR(VectorXd(model.C_peak).dot(state_model), peak, 1e-6 * std::abs(peak));
      EXPECT_NEAR((MatrixXd(model.C_volume) * state_model).dot(VectorXd(theta)), volume,
                  1e-6 * std::abs(volume));
    }
  }
}

// Two-sided balanced truncation: no transfer function between a sampled input and output is off by
// more than twice the sum of the Hankel singular values left out; here the consequence, that the
// error falls quickly with the order, for it and for every other method.
TEST(Bases, ErrorsFallWithTheOrder) {
  const auto full = model_of(Tissue{}, 20000);
  for (const double period : {1e-3, 4e-3}) {
    const ImpulseSpace space = reduction_space(*full);
    const ValidationRun run = validation_run(full, Discretization::kZeroOrderHold, period);
    for (const ReductionMethod method : kMethods) {
      SCOPED_TRACE(to_string(method));
      double last = 1.0;
      for (const int order : {3, 6, 10, 14}) {
        const ReducedModel model = project_model(
            *full, space, {.method = method, .order = order, .refinement = Refinement::kNone},
            period, Discretization::kZeroOrderHold);
        const ErrorReport error = measure_error(model, run);
        const double worst = std::max(error.peak_max(), error.volume_max());
        EXPECT_LT(worst, 0.95 * last) << order;
        last = worst;
      }
      EXPECT_LT(last, 0.005);
    }
  }
}

TEST(Compare, IsCompleteDeterministicAndMeasuresAsReduceDoes) {
  const auto full = model_of(Tissue{}, 3000);
  const Comparison comparison = compare_reductions(full, 4e-3, Discretization::kZeroOrderHold);
  ASSERT_EQ(comparison.methods.size(),
            (std::size(kMethods) + 1U) * 13U);  // and the refined default
  for (const ReductionMethod method : kMethods) {
    for (int order = 2; order <= 14; ++order) {
      EXPECT_TRUE(std::isfinite(comparison.error(method, order))) << to_string(method) << order;
    }
  }
  EXPECT_TRUE(std::isnan(comparison.error(ReductionMethod::kIrka, 15)));
  EXPECT_LT(comparison.error(ParameterDependence::kChebyshev, 8),
            comparison.error(ParameterDependence::kTaylor, 3));
  // Again and in another order, each by itself: the same numbers. The first of each method, the
  // middle and the last; likewise of the dependences.
  const ImpulseSpace space = reduction_space(*full);
  const ValidationRun run = validation_run(full, Discretization::kZeroOrderHold, 4e-3);
  int compared = 0;
  const auto again = [&](const std::vector<ComparisonRow>& rows, std::size_t step) {
    for (std::size_t i = rows.size(); i-- > 0;) {
      if (i % step != 0 || rows[i].peak == 0.0) continue;
      const ErrorReport error = measure_error(
          project_model(*full, space, rows[i].settings, 4e-3, Discretization::kZeroOrderHold), run);
      EXPECT_EQ(rows[i].peak, error.peak_max()) << i;
      EXPECT_EQ(rows[i].volume, error.volume_max()) << i;
      ++compared;
    }
  };
  again(comparison.methods, 6);
  again(comparison.dependences, 6);
  EXPECT_GE(compared, 14);
  // Measured through the shared run or alone: the same numbers.
  const ReducedModel model =
      reduce(full, {.refinement = Refinement::kNone}, 4e-3, Discretization::kZeroOrderHold);
  EXPECT_EQ(comparison.error(ReductionMethod::kPodDeim, 6),
            std::max(model.error.peak_max(), model.error.volume_max()));
}

}  // namespace
}  // namespace photocoag
