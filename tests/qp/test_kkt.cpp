// The check of an answer, on a problem whose multipliers are known by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "photocoag/qp/dense.hpp"
#include "photocoag/qp/kkt.hpp"
#include "qp/exam.hpp"

namespace photocoag::qp_exam {
namespace {

// min (u0 - 2)^2 + (u1 - 2)^2, 0 <= u <= 1, u0 + u1 <= 1.5: u = (0.75, 0.75), row multiplier 2.5.
QpProblem corner() {
  QpProblem qp;
  qp.resize(2, 1);
  qp.hessian << 2, 0, 0, 2;
  qp.gradient << -4, -4;
  qp.lower.setZero();
  qp.upper.setOnes();
  qp.rows << 1, 1;
  qp.limit << 1.5;
  return qp;
}

QpSolution answer(double u0, double u1, double row, double bound0 = 0.0) {
  QpSolution s;
  s.power.resize(2);
  s.power << u0, u1;
  s.bound_multiplier.resize(2);
  s.bound_multiplier << bound0, 0.0;
  s.row_multiplier.resize(1);
  s.row_multiplier << row;
  return s;
}

TEST(Kkt, ResidualOfTheMinimizerIsZero) {
  EXPECT_EQ(evaluate_kkt(corner(), answer(0.75, 0.75, 2.5)).largest(), 0.0);
}

TEST(Kkt, NamesTheConditionThatIsViolated) {
  const QpProblem qp = corner();
  KktResidual kkt = evaluate_kkt(qp, answer(0.75, 0.75, 2.0));
  // 4 - 1.5 - 2 = 0.5 over the terms 4 + 2 * 1 + 2.
  EXPECT_DOUBLE_EQ(kkt.stationarity, 0.5 / 8.0);
  EXPECT_EQ(kkt.feasibility, 0.0);
  kkt = evaluate_kkt(qp, answer(1.0, 1.0, 2.0));
  EXPECT_EQ(kkt.stationarity, 0.0);
  EXPECT_DOUBLE_EQ(kkt.feasibility, 0.25);  // 0.5 over the reach 2
  kkt = evaluate_kkt(qp, answer(0.5, 0.5, 3.0));
  EXPECT_EQ(kkt.stationarity, 0.0);
  EXPECT_EQ(kkt.feasibility, 0.0);
  EXPECT_DOUBLE_EQ(kkt.complementarity, 0.5 * 3.0 / (9.0 + 9.0));
  kkt = evaluate_kkt(qp, answer(0.75, 0.75, 2.5, 1.0));  // a multiplier on a bound that is not met
  EXPECT_GT(kkt.complementarity, 0.01);
  EXPECT_GT(evaluate_kkt(qp, answer(0.75, 0.75, -2.5)).complementarity, 0.1);
  EXPECT_GT(evaluate_kkt(qp, answer(1.5, 0.0, 2.5)).feasibility, 0.4);  // outside the box
}

TEST(Kkt, WhatIsNotFiniteIsInfinitelyFar) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isinf(evaluate_kkt(corner(), answer(nan, 0.75, 2.5)).largest()));
  EXPECT_TRUE(std::isinf(evaluate_kkt(corner(), answer(0.75, 0.75, nan)).largest()));
}

TEST(Kkt, IsZeroToRoundingForTheExactSolverOnly) {
  Random random(12);
  DenseSolver solver;
  QpSolution solution;
  for (int k = 0; k < 200; ++k) {
    const Case c = large_case(random, random.integer(1, 49), random.integer(0, 49));
    ASSERT_EQ(solver.solve(c.problem, solution), QpStatus::kSolved);
    EXPECT_LE(evaluate_kkt(c.problem, solution).largest(), 2e-13);
    // A step of 1e-6 away from the minimizer, inside the box, is seen.
    QpSolution moved = solution;
    moved.power(0) += moved.power(0) > 0.5 ? -1e-6 : 1e-6;
    EXPECT_GE(evaluate_kkt(c.problem, moved).largest(), 1e-11);
  }
}

}  // namespace
}  // namespace photocoag::qp_exam
