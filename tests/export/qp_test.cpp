// The exported quadratic program sits the exam of every solver (tests/qp). Its size is that of the
// horizon: smaller problems are padded with inputs that are fixed at 0 and rows without limit.
#include <gtest/gtest.h>

#include <limits>

#include "export/exported.hpp"
#include "qp/exam.hpp"
#include "support/reduced_models.hpp"

namespace photocoag::testing {
namespace {

using namespace qp_exam;

constexpr int kSize = 19;
// As DenseSolver promises (tests/qp/test_exam.cpp).
constexpr Tolerances kTolerances{
    .power = 1e-12, .stationarity = 1e-13, .feasibility = 2e-13, .infeasibility = 1e-9};

const Exported& exported() {
  static const Exported solver = [] {
    ControlSettings control;
    control.horizon = kSize + 1;
    return Exported(export_c(coarse_model(), control, {}, {}), {"-O1"});
  }();
  return solver;
}

QpProblem padded(const QpProblem& qp) {
  QpProblem out;
  out.resize(kSize, kSize);
  out.hessian.setIdentity();
  out.gradient.setZero();
  out.lower.setZero();
  out.upper.setZero();
  out.rows.setZero();
  out.limit.setConstant(std::numeric_limits<double>::infinity());
  const Eigen::Index n = qp.hessian.rows();
  const Eigen::Index m = qp.rows.rows();
  out.hessian.topLeftCorner(n, n) = qp.hessian;
  out.gradient.head(n) = qp.gradient;
  out.lower.head(n) = qp.lower;
  out.upper.head(n) = qp.upper;
  if (m > 0) out.rows.topLeftCorner(m, n) = qp.rows;
  out.limit.head(m) = qp.limit;
  return out;
}

double pass(const Case& c) {
  const QpProblem qp = padded(c.problem);
  const Eigen::Index n = c.problem.hessian.rows();
  const Eigen::Index m = c.problem.rows.rows();
  double power[kSize];
  double bound[kSize];
  double row[kSize];
  QpSolution solution;
  // The numbers of the statuses are the same in C.
  solution.status = static_cast<QpStatus>(
      exported().qp(qp.hessian.data(), qp.gradient.data(), qp.lower.data(), qp.upper.data(),
                    qp.rows.data(), qp.limit.data(), power, bound, row));
  solution.power = Eigen::Map<Eigen::VectorXd>(power, n);
  solution.bound_multiplier = Eigen::Map<Eigen::VectorXd>(bound, n);
  solution.row_multiplier = Eigen::Map<Eigen::VectorXd>(row, m);
  EXPECT_EQ(judge(c, solution.status, solution, kTolerances), "");
  return solution.power(0);
}

double pass_with_oracle(Case c) {
  consult_oracle(c, kTolerances);
  return pass(c);
}

TEST(ExportedQp, PassesTheExam) { for_each_exam_case(kTolerances, pass); }

TEST(ExportedQp, MatchesEnumeration) {
  Random random(1);
  for (int k = 0; k < 1000; ++k) {
    pass_with_oracle(random_case(random, random.integer(1, 4), random.integer(0, 4)));
    pass_with_oracle(degenerate_case(random));
    const double size = std::pow(10.0, random.uniform(-16, -1));
    pass_with_oracle(nearly_infeasible_case(random, random.chance(0.5) ? size : -size));
  }
}

TEST(ExportedQp, SolvesLargeAndIllConditionedProblems) {
  Random random(2);
  for (int k = 0; k < 300; ++k) {
    pass(large_case(random, random.integer(2, kSize), random.integer(1, kSize)));
    // u itself is not determined better than condition * 1e-16: judged by the KKT conditions.
    Case c = ill_conditioned_case(random, std::pow(10.0, random.uniform(3, 10)));
    Case truth = c;
    consult_oracle(truth, kTolerances);
    c.expected = truth.expected;
    pass(c);
  }
}

TEST(ExportedQp, SolvesTheApplicationsProblems) {
  for (const double weight : {0.0, 100.0}) {
    for (const bool delayed : {false, true}) {
      run_application({.horizon = 10,
                       .power_weight = weight + (delayed ? 0.5 : 0.0),
                       .change_weight = weight,
                       .delayed = delayed},
                      3, pass);
    }
  }
}

TEST(ExportedQp, BadDataGiveTheSafePower) {
  Random random(4);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int where = 0; where < 5; ++where) {
      Case c = random_case(random, 3, 2);
      c.expected = Expected::kFailure;
      if (where == 0) c.problem.hessian(1, 1) = bad;
      if (where == 1) c.problem.gradient(2) = bad;
      if (where == 2) c.problem.upper(0) = bad;
      if (where == 3) c.problem.rows(1, 2) = bad;
      if (where == 4) c.problem.limit(0) = -bad;
      pass(c);
    }
  }
}

}  // namespace
}  // namespace photocoag::testing
