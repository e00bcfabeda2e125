// The check of an answer, on a problem whose multipliers are known by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/qp/dense.hpp"
#include "photocoag/qp/factor.hpp"
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

// How far a row reaches within the box, not what its coefficients add up to.
TEST(Kkt, AnExceededRowIsMeasuredByItsReach) {
  QpProblem qp = corner();
  qp.upper << 4, 0.1;
  EXPECT_NEAR(evaluate_kkt(qp, answer(1.6, 0.1, 2.5)).feasibility, 0.2 / 4.1, 1e-15);
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

// min (u0 - 0.5)^2 + (u1 - 0.25)^2 in the corner's box: u = (0.5, 0.25), nothing binds.
QpProblem inside(int inputs = 2) {
  QpProblem qp = corner();
  qp.gradient << -1, -0.5;
  // The same with further inputs that stand alone: every length of the loops.
  QpProblem out;
  out.resize(inputs, 1);
  out.hessian.setZero();
  out.rows.setZero();
  out.hessian.diagonal().setConstant(2.0);
  out.gradient.setConstant(-1.0);
  out.lower.setZero();
  out.upper.setOnes();
  out.limit = qp.limit;
  const int shared = std::min(inputs, 2);
  out.gradient.head(shared) = qp.gradient.head(shared);
  out.rows.leftCols(shared) = qp.rows.leftCols(shared);
  return out;
}

TEST(InnerResidual, IsZeroAtTheMinimizerAndBoundsStationarity) {
  for (const int n : {1, 2, 3, 4, 5, 9, 14, 49}) {
    const QpProblem qp = inside(n);
    InputVector u = -0.5 * qp.gradient;
    EXPECT_EQ(inner_residual(qp, u.data()), 0.0) << n;
    for (int j = 0; j < n; ++j) {
      InputVector moved = u;
      moved(j) += 1e-9;
      EXPECT_GT(inner_residual(qp, moved.data()), 5e-10) << n << ", input " << j;
    }
  }
  Random random(31);
  int inner = 0;
  for (int k = 0; k < 400; ++k) {
    const int n = random.integer(1, 49);
    Case c = large_case(random, n, random.integer(0, 1) == 0 ? n : random.integer(0, 49));
    c.problem.lower.array() -= 10.0;
    c.problem.upper.array() += 10.0;
    c.problem.limit.array() += 1e3;
    DenseSolver solver;
    QpSolution solution;
    ASSERT_EQ(solver.solve(c.problem, solution), QpStatus::kSolved);
    const double residual = inner_residual(c.problem, solution.power.data());
    if (!(residual < 1.0)) continue;
    ++inner;
    EXPECT_GE(residual, evaluate_kkt(c.problem, solution).stationarity);
    EXPECT_EQ(solution.kkt_residual, residual);
    EXPECT_EQ(solution.iterations, 0);
  }
  EXPECT_GT(inner, 100);
}

TEST(InnerResidual, IsInfiniteOutsideOfAnythingAndForBadData) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const int n : {2, 5}) {
    const InputVector u = -0.5 * inside(n).gradient;
    const auto of = [&](auto change) {
      QpProblem qp = inside(n);
      change(qp);
      return inner_residual(qp, u.data());
    };
    EXPECT_EQ(of([](QpProblem& qp) { qp.limit(0) = 0.75; }), 0.0);
    EXPECT_EQ(of([&](QpProblem& qp) { qp.limit(0) = infinity; }), 0.0);
    EXPECT_EQ(of([](QpProblem& qp) { qp.limit(0) = 0.75 - 1e-16; }), infinity);
    EXPECT_EQ(of([](QpProblem& qp) { qp.lower(1) = 0.25 + 1e-16; }), infinity);
    EXPECT_EQ(of([](QpProblem& qp) { qp.upper(0) = 0.5 - 1e-16; }), infinity);
    for (const double bad : {nan, infinity, -infinity}) {
      EXPECT_EQ(of([&](QpProblem& qp) { qp.hessian(1, 0) = bad; }), infinity);
      EXPECT_EQ(of([&](QpProblem& qp) { qp.hessian(0, 1) = bad; }), infinity);
      EXPECT_EQ(of([&](QpProblem& qp) { qp.gradient(1) = bad; }), infinity);
      EXPECT_EQ(of([&](QpProblem& qp) { qp.rows(0, 1) = bad; }), infinity);
      EXPECT_EQ(of([&](QpProblem& qp) { qp.lower(0) = bad; }), infinity);
      EXPECT_EQ(of([&](QpProblem& qp) { qp.upper(1) = bad; }), infinity);
      InputVector wrong = u;
      wrong(1) = bad;
      EXPECT_EQ(inner_residual(inside(n), wrong.data()), infinity);
    }
    for (const double bad : {nan, -infinity}) {
      EXPECT_EQ(of([&](QpProblem& qp) { qp.limit(0) = bad; }), infinity);
    }
  }
}

TEST(HessianFactor, SolvesAtEveryLength) {
  Random random(32);
  for (int n = 1; n <= 49; ++n) {
    const QpProblem qp = large_case(random, n, 0).problem;
    HessianFactor factor;
    InputVector u(n);
    ASSERT_TRUE(factor.minimize(qp.hessian, qp.gradient, u.data()));
    EXPECT_LE((qp.hessian * u + qp.gradient).norm(), 1e-10 * qp.gradient.norm()) << n;
    // U^-1 H U^-T = I, column by column; where only the first entries of x are not 0 as elsewhere.
    factor.prepare_solutions();
    Eigen::MatrixXd unit(n, n);
    for (int k = 0; k < n; ++k) {
      InputVector x = InputVector::Unit(n, k);
      factor.solve_transposed(n, x.data());
      x = (qp.hessian * x).eval();
      factor.solve(n, x.data(), n);
      unit.col(k) = x;
      InputVector first = InputVector::Unit(n, k);
      InputVector whole = first;
      factor.solve(n, first.data(), k + 1);
      factor.solve(n, whole.data(), n);
      EXPECT_EQ(first, whole);
      if (n == 4) {  // a length that the compiler knows: the same bits
        constexpr std::integral_constant<int, 4> kFour;
        InputVector known = InputVector::Unit(n, k);
        factor.solve(kFour, known.data(), k + 1);
        EXPECT_EQ(known, whole);
        factor.solve_transposed(n, whole.data());
        factor.solve_transposed(kFour, known.data());
        EXPECT_EQ(known, whole);
        continue;
      }
      EXPECT_TRUE((whole.tail(n - 1 - k).array() == 0.0).all());
    }
    EXPECT_LE((unit - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-9) << n;
    QpProblem flat = qp;
    flat.hessian.row(n - 1) = flat.hessian.row(0);
    flat.hessian.col(n - 1) = flat.hessian.col(0);
    if (n > 1) flat.hessian(n - 1, n - 1) = flat.hessian(0, 0);
    EXPECT_EQ(factor.minimize(flat.hessian, flat.gradient, u.data()), n == 1);
    flat.hessian(0, 0) = -1.0;
    EXPECT_FALSE(factor.minimize(flat.hessian, flat.gradient, u.data()));
  }
}

}  // namespace
}  // namespace photocoag::qp_exam
