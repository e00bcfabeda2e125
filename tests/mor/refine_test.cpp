// The output-error fit: never worse than its start, keeps the structure, and finds what is there.
#include "photocoag/mor/refine.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numeric>

#include "photocoag/fom/stepper.hpp"
#include "photocoag/mor/reduce.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kPeriod = 1e-3;

class Refine : public ::testing::Test {
 protected:
  static void prepare(const Tissue& tissue) {
    full = std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = 5000});
    space = reduction_space(*full);
  }

  static ReducedModel model(const ReductionSettings& settings) {
    return project_model(*full, space, settings, kPeriod, Discretization::kZeroOrderHold);
  }

  static inline std::shared_ptr<const FullOrderModel> full;
  static inline ImpulseSpace space;
};

// Sum over the first 400 ms of |e_k| / steady gain, both outputs, on alphas that are not trained
// on.
double response_error(const std::shared_ptr<const FullOrderModel>& full,
                      const ReducedModel& model) {
  constexpr int kPeriods = 400;
  double worst = 0.0;
  for (const double alpha : {0.4, 0.8, 1.3}) {
    std::vector<double> pulse(kPeriods, 0.0);
    pulse[0] = 1.0;
    FullOrderPlant eye(full, Discretization::kZeroOrderHold, kPeriod, alpha);
    ReducedPlant plant(model, alpha);
    double error = 0.0;
    double sum = 0.0;
    for (const double power : pulse) {
      eye.step(power);
      plant.step(power);
      error += std::abs(eye.outputs().peak - plant.outputs().peak);
      sum += eye.outputs().peak;
    }
    worst = std::max(worst, error / sum);
  }
  return worst;
}

TEST_F(Refine, KeepsTheStructureOnEveryTissue) {
  for (const auto& [name, tissue] : testing::various_tissues()) {
    SCOPED_TRACE(name);
    prepare(tissue);
    for (const ReductionMethod method : {ReductionMethod::kPodDeim, ReductionMethod::kIrka}) {
      const ReducedModel refined = model({.method = method});
      const MatrixXd A = refined.A;
      EXPECT_EQ(A, MatrixXd(A.diagonal().asDiagonal()));
      EXPECT_LT(A.diagonal().maxCoeff(), 0.0);
      EXPECT_TRUE((MatrixXd(refined.C_peak).array() >= 0.0).all());
      EXPECT_LT((MatrixXd(refined.B) - full->input_gain() * MatrixXd(refined.C_volume).transpose())
                    .norm(),
                1e-14 * MatrixXd(refined.B).norm());
      for (int i = 1; i < refined.order(); ++i) EXPECT_LE(A(i, i), A(i - 1, i - 1));
    }
  }
}

// Not the sharpest statement, but one that the fit of a wrong gradient does not pass: the error of
// a well-posed fit falls by an order of magnitude at order 10.
TEST_F(Refine, BringsTheErrorDown) {
  for (const Tissue& tissue : {Tissue{}, testing::literature_choroid()}) {
    prepare(tissue);
    for (const int order : {8, 10}) {
      const double projected =
          response_error(full, model({.order = order, .refinement = Refinement::kNone}));
      const double refined = response_error(full, model({.order = order}));
      EXPECT_LT(refined, 0.5 * projected) << "order " << order;
    }
  }
}

// What the documents promise of the default: proved for all time and any power from 0 to u_max,
// relative to the steady gain.
TEST(CertifiedError, OrderSixAndTen) {
  const auto full = std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{});
  struct Promise {
    int order;
    double peak;
    double volume;
  };
  for (const Promise& promise : {Promise{6, 0.025, 0.025}, Promise{10, 0.008, 0.008}}) {
    for (const double period : {1e-3, 4e-3}) {
      const ReducedModel model =
          reduce(full, {.order = promise.order}, period, Discretization::kZeroOrderHold);
      ASSERT_TRUE(model.certificate.has_value());
      EXPECT_LE(model.certificate->peak.relative_max(), promise.peak) << promise.order;
      EXPECT_LE(model.certificate->volume.relative_max(), promise.volume) << promise.order;
    }
  }
}

TEST_F(Refine, SameInputSameBits) {
  prepare(Tissue{});
  const ReducedModel first = model({});
  const ReducedModel second = model({});
  EXPECT_EQ(MatrixXd(first.A), MatrixXd(second.A));
  EXPECT_EQ(MatrixXd(first.B), MatrixXd(second.B));
}

// Eight Chebyshev terms at order 6: the sum of squares falls and the largest error rises.
TEST_F(Refine, IsNotKeptWhereItMakesTheModelWorse) {
  prepare(Tissue{});
  const ReductionSettings refined{.parameter_dependence = ParameterDependence::kChebyshev};
  ReductionSettings projected = refined;
  projected.refinement = Refinement::kNone;
  const auto error = [&](const ReducedModel& one) {
    return response_error(*full, space, kPeriod, Discretization::kZeroOrderHold, one);
  };
  EXPECT_GT(error(model(refined)), 2.0 * error(model(projected)));
  const ReducedModel kept = reduce(full, refined, kPeriod, Discretization::kZeroOrderHold);
  EXPECT_EQ(kept.refinement, "none");
  EXPECT_LE(error(kept), error(model(projected)) * (1.0 + 1e-9));
  // The default gains by it.
  EXPECT_LT(error(model({})), 2.0 * error(model({.refinement = Refinement::kNone})));
  EXPECT_EQ(reduce(full, {}, kPeriod, Discretization::kZeroOrderHold).refinement, "output-error");
}

}  // namespace
}  // namespace photocoag
