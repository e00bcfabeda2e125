#include "photocoag/rom/discretize.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

namespace photocoag {
namespace {

using Eigen::Matrix2d;
using Eigen::MatrixXd;

constexpr auto kHold = Discretization::kZeroOrderHold;
constexpr auto kEuler = Discretization::kImplicitEuler;

TEST(Discretize, ScalarsInClosedForm) {
  // Slow, moderate and stiff: rate times period from 1e-9 to 4e6.
  for (const double rate : {1e-6, 0.5, 300.0, 1e9}) {
    for (const double period : {1e-3, 4e-3}) {
      const MatrixXd A = MatrixXd::Constant(1, 1, -rate);
      const DiscretePair hold = discretize(A, period, kHold);
      EXPECT_NEAR(hold.transition(0, 0), std::exp(-rate * period), 1e-13);
      // The exponential squares its way up from a norm of 1: rounding times the number rate *
      // period.
      EXPECT_NEAR(hold.input(0, 0) / (-std::expm1(-rate * period) / rate), 1.0,
                  1e-14 + 1e-15 * rate * period)
          << rate;
      const DiscretePair euler = discretize(A, period, kEuler);
      EXPECT_NEAR(euler.transition(0, 0) * (1.0 + rate * period), 1.0, 1e-14);
      EXPECT_NEAR(euler.input(0, 0) * (1.0 + rate * period) / period, 1.0, 1e-14);
    }
  }
}

TEST(Discretize, SingularMatrixIsNoSpecialCase) {
  // A double integrator: e^(Ah) = [1 h; 0 1], integral = [h h^2/2; 0 h].
  Matrix2d A;
  A << 0.0, 1.0, 0.0, 0.0;
  const double h = 0.25;
  const DiscretePair pair = discretize(A, h, kHold);
  Matrix2d transition;
  transition << 1.0, h, 0.0, 1.0;
  Matrix2d input;
  input << h, h * h / 2.0, 0.0, h;
  EXPECT_LT((pair.transition - transition).norm(), 1e-15);
  EXPECT_LT((pair.input - input).norm(), 1e-15);
}

TEST(Discretize, OscillatorInClosedForm) {
  Matrix2d A;
  A << 0.0, 3.0, -3.0, 0.0;
  const double h = 0.4;
  const DiscretePair pair = discretize(A, h, kHold);
  EXPECT_NEAR(pair.transition(0, 0), std::cos(3.0 * h), 1e-14);
  EXPECT_NEAR(pair.transition(0, 1), std::sin(3.0 * h), 1e-14);
  EXPECT_NEAR(pair.input(0, 0), std::sin(3.0 * h) / 3.0, 1e-14);
  EXPECT_NEAR(pair.input(0, 1), (1.0 - std::cos(3.0 * h)) / 3.0, 1e-14);
}

// Two steps of h are one of 2h with the same power; and for implicit Euler (I - hA) undoes the
// step.
TEST(Discretize, KeepsItsDefiningIdentities) {
  MatrixXd A(3, 3);
  A << -5.0, 1.0, 0.5, 0.2, -40.0, 3.0, 0.0, 1.5, -300.0;
  const DiscretePair one = discretize(A, 1e-3, kHold);
  const DiscretePair two = discretize(A, 2e-3, kHold);
  EXPECT_LT((one.transition * one.transition - two.transition).norm(), 1e-14);
  EXPECT_LT((one.transition * one.input + one.input - two.input).norm(), 1e-16);
  EXPECT_LT((A * two.input - (two.transition - MatrixXd::Identity(3, 3))).norm(), 1e-14);
  const DiscretePair euler = discretize(A, 1e-3, kEuler);
  const MatrixXd undo = MatrixXd::Identity(3, 3) - 1e-3 * A;
  EXPECT_LT((undo * euler.transition - MatrixXd::Identity(3, 3)).norm(), 1e-14);
  EXPECT_LT((undo * euler.input - 1e-3 * MatrixXd::Identity(3, 3)).norm(), 1e-17);
}

}  // namespace
}  // namespace photocoag
