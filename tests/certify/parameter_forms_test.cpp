// Every form of the model's dependence on the absorption factors: DEIM, Chebyshev and Taylor terms,
// two factors. What is enclosed over a cell holds the controller's problem at points of it, and the
// proved number holds against the attack.
#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <string>
#include <vector>

#include "certify/attack.hpp"
#include "photocoag/certify/cell_problem.hpp"
#include "photocoag/certify/certify.hpp"
#include "photocoag/certify/sampled_problem.hpp"
#include "support/reduced_models.hpp"
#include "support/tissues.hpp"

namespace photocoag::testing {
namespace {

struct Form {
  std::string name;
  ThetaKind kind;
  int parameters;
  ReducedModel model;
};

ReducedModel model_of(const Tissue& tissue, const ReductionSettings& settings) {
  return reduce(coarse_full_model(tissue), settings, 1e-3, Discretization::kZeroOrderHold);
}

const std::vector<Form>& forms() {
  static const std::vector<Form> all = [] {
    const ReductionSettings chebyshev{.parameter_dependence = ParameterDependence::kChebyshev};
    const ReductionSettings taylor{.method = ReductionMethod::kTaylor, .order = 4};
    return std::vector<Form>{
        {"deim", ThetaKind::kDeim, 1, coarse_model()},
        {"chebyshev", ThetaKind::kChebyshev, 1, model_of({}, chebyshev)},
        {"taylor", ThetaKind::kTaylor, 1, model_of({}, taylor)},
        {"deim, beta", ThetaKind::kDeim, 2, model_of(with_beta(), {})},
        {"chebyshev, beta", ThetaKind::kChebyshev, 2, model_of(with_beta(), chebyshev)},
    };
  }();
  return all;
}

// Where the form is good: Taylor's is around its centre alone.
CertifiedBox box_for(const Form& form, double low, double high) {
  CertifiedBox box = box_of(low, high);
  if (form.kind == ThetaKind::kTaylor) box.absorption = {0.65, 0.8};
  if (form.parameters == 2) box.choroid = {0.8, 1.25};
  return box;
}

TEST(ParameterForms, AreTheOnesTheirNamesSay) {
  for (const Form& form : forms()) {
    EXPECT_EQ(form.model.theta.kind, form.kind) << form.name;
    EXPECT_EQ(static_cast<int>(form.model.parameters.size()), form.parameters) << form.name;
    if (form.kind == ThetaKind::kChebyshev) {
      EXPECT_EQ(form.model.theta.terms_of(1) > 1, form.parameters == 2) << form.name;
    }
  }
}

// c_0 + sum_i c_i x_i at a place of the cell.
Interval value_at(const CellProblem& cell, const Affine& affine, const std::vector<double>& x,
                  double s, double t) {
  const auto at = [&](const Varying& v) {
    return v.at_middle + v.slope[0] * Interval(s) + v.slope[1] * Interval(t);
  };
  Interval sum = at(affine[0]);
  for (int i = 1; i < cell.coefficients(); ++i) sum = sum + at(affine[i]) * Interval(x[i - 1]);
  return sum;
}

// The unconstrained minimizer and the one with an input at its upper bound, over small cells.
TEST(ParameterForms, TheCellHoldsTheControllersProblem) {
  constexpr int kInputs = 3;
  const ControlSettings settings{
      .horizon = kInputs + 1, .power_weight = 50.0, .power_change_weight = 1000.0};
  std::mt19937 random(11);
  std::uniform_real_distribution<> place(-1.0, 1.0);
  for (const Form& form : forms()) {
    SCOPED_TRACE(form.name);
    SampledProblem sampled(form.model, settings, 3);
    const CertifiedBox whole = box_for(form, 5.0, 35.0);
    for (int trial = 0; trial < 40; ++trial) {
      CertifiedBox box = whole;
      const auto narrow = [&](BoxRange& range, double share) {
        const double half = share * range.radius();
        const double middle = range.middle() + (range.radius() - half) * place(random);
        range = {middle - half, middle + half};
      };
      narrow(box.absorption, 0.02);
      if (form.parameters == 2) narrow(box.choroid, 0.05);
      CellProblem cell(form.model, settings, box, 3);
      ASSERT_TRUE(cell.definite());
      for (int i = 0; i < kInputs; ++i) cell.set_row(i, RowState::kLeftOut);
      for (int point = 0; point < 10; ++point) {
        const double s = place(random);
        const double t = form.parameters == 2 ? place(random) : 0.0;
        ParameterPoint at{.absorption = box.absorption.middle() + s * box.absorption.radius()};
        if (form.parameters == 2) at.choroid = box.choroid.middle() + t * box.choroid.radius();
        std::vector<double> x;
        for (int k = 0; k < kInputs; ++k) {
          x.push_back(place(random));
          at.free[k] = box.free[k].middle() + x.back() * box.free[k].radius();
        }
        x.push_back(place(random));
        at.previous = box.previous.middle() + x.back() * box.previous.radius();
        const QpProblem& qp = sampled.at(at);
        const Eigen::VectorXd exact =
            -solve_symmetric(Eigen::MatrixXd(qp.hessian), Eigen::VectorXd(qp.gradient));
        const double first = qp.rows(0, 0);  // h_0 u_max: the cell's powers are in K
        for (int j = 0; j < kInputs; ++j) {
          const Interval held = value_at(cell, cell.equality(0).power[j], x, s, t);
          // The exact one's own rounding.
          const double rounding = 1e-9 * first;
          EXPECT_LE(held.low, first * exact[j] + rounding);
          EXPECT_GE(held.high, first * exact[j] - rounding);
          EXPECT_LT(held.high - held.low, 0.25 * first);  // of u_max: it says something
        }
      }
    }
  }
}

TEST(ParameterForms, TheProvedNumberHoldsAgainstTheAttack) {
  const ControlSettings settings{.horizon = 3};
  const std::atomic<bool> stop{false};
  for (const Form& form : forms()) {
    SCOPED_TRACE(form.name);
    const CertifiedBox box = box_for(form, 0.0, 40.0);
    const Certificate found = certify(form.model, settings, box, {.samples = 20'000}, stop);
    EXPECT_EQ(found.share, 1.0);
    EXPECT_EQ(found.proved, found.seen);
    EXPECT_LT(found.proved, found.hard_bound);
    const int most = Attack(form.model, settings, box).most(100'000);
    EXPECT_LE(most, found.proved);
    EXPECT_GT(most, found.proved - 1);
  }
}

}  // namespace
}  // namespace photocoag::testing
