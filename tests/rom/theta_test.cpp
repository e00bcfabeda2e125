// Evaluation of every kind of parameter dependence, online.
#include "photocoag/rom/theta.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/rom/certificate.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "support/heap_guard.hpp"

namespace photocoag {
namespace {

Theta theta_of(ThetaKind kind, int terms) {
  Theta theta{.terms = terms, .kind = kind};
  for (int j = 0; j < terms; ++j) {
    theta.points[j] = {.fixed_back = 0.01, .front = {0.05 * j}, .back = {0.05 * (j + 1)}};
  }
  if (kind == ThetaKind::kChebyshev) theta.factors[0] = {.center = 1.1, .half_width = 0.9};
  if (kind == ThetaKind::kTaylor) theta.factors[0].center = 0.7363;
  return theta;
}

TEST(Theta, PolynomialsAreThoseOfTheBooks) {
  TermVector value;
  TermVector slope;
  theta_of(ThetaKind::kChebyshev, 12).evaluate(1.1 + 0.9 * std::cos(0.4), value, slope);
  for (int j = 0; j < 12; ++j) {
    EXPECT_NEAR(value[j], std::cos(0.4 * j), 1e-13);
    EXPECT_NEAR(slope[j], j * std::sin(0.4 * j) / std::sin(0.4) / 0.9, 1e-11);
  }
  theta_of(ThetaKind::kTaylor, 4).evaluate(0.7363 + 2.0, value, slope);
  EXPECT_NEAR(value[3], 8.0, 1e-14);
  EXPECT_NEAR(slope[3], 12.0, 1e-14);
  EXPECT_EQ(slope[0], 0.0);
}

TEST(Theta, EvaluatesWithoutAllocating) {
  for (const ThetaKind kind : {ThetaKind::kDeim, ThetaKind::kChebyshev, ThetaKind::kTaylor}) {
    ReducedModel model;
    model.theta = theta_of(kind, 8);
    model.A = StateMatrix((Eigen::VectorXd::LinSpaced(6, -2.0, -900.0)).asDiagonal());
    model.B = InputTerms::Ones(6, 8);
    model.C_volume = OutputTerms::Ones(8, 6);
    model.C_peak = StateVector::Ones(6);
    model.discretize(1e-3, Discretization::kZeroOrderHold);
    ParametricMatrices matrices;
    const testing::HeapGuard guard;
    for (int i = 0; i < 100; ++i) model.evaluate(0.2 + 0.018 * i, matrices);
    const testing::HeapUse use = guard.use();
    EXPECT_EQ(use, testing::HeapUse{});
    EXPECT_GT(std::abs(matrices.input[0]), 0.0);
  }
}

TEST(RunningErrorBound, IsTheSumOfItsExponentialsAndDoesNotAllocate) {
  OutputCertificate output{.bound = {1.0, 2.0},
                           .relative = {0.01, 0.02},
                           .treatment_bound = {0.5, 1.0},
                           .treatment_relative = {0.005, 0.01},
                           .sum = {1.0, 2.0},
                           .scale = {3.0, 5.0},
                           .majorant = {0.25, 2.0}};
  ErrorCertificate certificate{
      .absorption_factors = {0.5, 1.0}, .peak = output, .volume = output, .decay = {0.9, 0.0}};
  certificate.volume.scale = {1.0, 1.0};
  RunningErrorBound bound(certificate);
  const testing::HeapGuard guard;
  bound.step(0.1);
  const Outputs first = bound.bound(0.5);
  bound.step(0.0);
  const Outputs second = bound.bound(0.75);
  const Outputs beyond = bound.bound(7.0);
  bound.reset();
  const Outputs cold = bound.bound(0.75);
  const testing::HeapUse use = guard.use();
  EXPECT_EQ(use, testing::HeapUse{});
  EXPECT_NEAR(first.peak, 3.0 * 0.1 * (0.25 + 2.0), 1e-15);
  EXPECT_NEAR(first.volume, 0.1 * (0.25 + 2.0), 1e-15);
  EXPECT_NEAR(second.peak, 4.0 * 0.1 * 0.25 * 0.9, 1e-15);
  EXPECT_NEAR(beyond.peak, 5.0 * 0.1 * 0.25 * 0.9, 1e-15);
  EXPECT_EQ(cold.peak, 0.0);
  EXPECT_NEAR(certificate.bound(0.75, 0.1).peak, 0.15, 1e-15);
}

}  // namespace
}  // namespace photocoag
