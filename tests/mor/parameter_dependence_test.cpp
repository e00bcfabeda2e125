// B(alpha) and C_vol(alpha) as sums: how near, and that derivatives are those of the sums.
#include "photocoag/mor/parameter_dependence.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/mor/deim.hpp"
#include "photocoag/mor/theta_derivatives.hpp"
#include "photocoag/tissue/absorption_derivatives.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr ParameterDependence kAll[] = {ParameterDependence::kDeim, ParameterDependence::kQDeim,
                                        ParameterDependence::kChebyshev,
                                        ParameterDependence::kTaylor};

double largest_error(const FullOrderModel& full, ParameterDependence dependence, int terms,
                     double low, double high) {
  const ParametricSource source = parametric_source(full, dependence, terms);
  double worst = 0.0;
  for (int i = 0; i <= 60; ++i) {
    const double alpha = low + (high - low) * i / 60;
    TermVector theta;
    TermVector slope;
    source.theta.evaluate(alpha, theta, slope);
    const VectorXd exact = full.axial_source(alpha);
    worst = std::max(worst, (source.sources * VectorXd(theta) - exact).norm() / exact.norm());
  }
  return worst;
}

// The numbers of docs/models.md: entire functions of alpha, interpolated.
TEST(ParameterDependence, InterpolationErrors) {
  const FullOrderModel full(Tissue{}, GridSettings{.min_cells = 5000});
  EXPECT_LT(largest_error(full, ParameterDependence::kChebyshev, 5, 0.2, 2.0), 1e-3);
  EXPECT_LT(largest_error(full, ParameterDependence::kChebyshev, 8, 0.2, 2.0), 5e-7);
  EXPECT_LT(largest_error(full, ParameterDependence::kChebyshev, 12, 0.2, 2.0), 1e-11);
  EXPECT_LT(largest_error(full, ParameterDependence::kDeim, 5, 0.2, 2.0), 1e-4);
  EXPECT_LT(largest_error(full, ParameterDependence::kQDeim, 5, 0.2, 2.0), 1e-4);
  // The series is good near its centre and worse than interpolation at the ends.
  EXPECT_LT(largest_error(full, ParameterDependence::kTaylor, 5, 0.7, 0.77), 1e-8);
  EXPECT_GT(largest_error(full, ParameterDependence::kTaylor, 5, 0.2, 2.0),
            5.0 * largest_error(full, ParameterDependence::kChebyshev, 5, 0.2, 2.0));
}

TEST(ParameterDependence, SlopesAreExact) {
  for (const Tissue& tissue : {Tissue{}, testing::literature_choroid()}) {
    const FullOrderModel full(tissue, GridSettings{.min_cells = 3000});
    for (const ParameterDependence dependence : kAll) {
      const Theta theta = parametric_source(full, dependence, 6).theta;
      for (const double alpha : {0.2, 0.5, 0.7363, 1.1, 2.0}) {
        const double step = 1e-5;
        TermVector below, above, value, slope, unused;
        theta.evaluate(alpha - step, below, unused);
        theta.evaluate(alpha + step, above, unused);
        theta.evaluate(alpha, value, slope);
        const VectorXd difference = (VectorXd(above) - VectorXd(below)) / (2.0 * step);
        // Central differences are good to step^2 third derivatives, up to 400 for T_5.
        EXPECT_LT((difference - VectorXd(slope)).cwiseAbs().maxCoeff(), 1e-6)
            << to_string(dependence) << alpha;
      }
    }
  }
}

// Derivatives of every order by differences of the order below, bounds by dense sampling.
TEST(ParameterDependence, HigherDerivativesAndTheirBounds) {
  const FullOrderModel full(Tissue{}, GridSettings{.min_cells = 3000});
  for (const ParameterDependence dependence : kAll) {
    const Theta theta = parametric_source(full, dependence, 6).theta;
    for (int n = 0; n <= 4; ++n) {
      const VectorXd bound = theta_derivative_bound(theta, {n}, {0.3, 1.7});
      for (int i = 0; i <= 280; ++i) {
        const double alpha = 0.3 + 1.4 * i / 280;
        const VectorXd value = theta_derivative(theta, {n}, alpha);
        for (int j = 0; j < theta.terms; ++j) {
          EXPECT_LE(std::abs(value[j]), bound[j] * (1.0 + 1e-12)) << to_string(dependence) << n;
        }
        const double step = 1e-4;
        const VectorXd next = (theta_derivative(theta, {n}, alpha + step) -
                               theta_derivative(theta, {n}, alpha - step)) /
                              (2.0 * step);
        const VectorXd exact = theta_derivative(theta, {n + 1}, alpha);
        EXPECT_LT((next - exact).cwiseAbs().maxCoeff(), 1e-5 * (1.0 + exact.cwiseAbs().maxCoeff()));
      }
    }
  }
}

// Absorbed fractions of cells in front of, in and behind the scaled layer, and of a range over all.
TEST(AbsorptionDerivatives, AgainstDifferencesAndSampling) {
  const AbsorptionLaw law{testing::literature_choroid()};
  const AbsorbedFraction cells[] = {law.between(0.0, 10e-6), law.between(190e-6, 190.2e-6),
                                    law.between(195e-6, 196e-6), law.between(300e-6, 310e-6),
                                    law.whole()};
  for (const AbsorbedFraction& cell : cells) {
    EXPECT_NEAR(derivative(cell, {0}, 0.8), cell.evaluate(0.8).value, 1e-15);
    EXPECT_NEAR(derivative(cell, {1}, 0.8), cell.evaluate(0.8).slope[0], 1e-15);
    for (int n = 0; n <= 4; ++n) {
      const double bound = derivative_bound(cell, {n}, {0.3, 1.7});
      double largest = 0.0;
      for (int i = 0; i <= 1000; ++i) {
        largest = std::max(largest, std::abs(derivative(cell, {n}, 0.3 + 1.4 * i / 1000)));
      }
      EXPECT_LE(largest, bound * (1.0 + 1e-12));
      EXPECT_LE(bound, 20.0 * largest) << "useless bound, n = " << n;
      const double step = 1e-3;
      const double difference =
          (derivative(cell, {n}, 0.8 + step) - derivative(cell, {n}, 0.8 - step)) / (2.0 * step);
      EXPECT_NEAR(derivative(cell, {n + 1}, 0.8), difference, 1e-6 * (bound + 1e-9));
    }
  }
}

// Orders by both factors: each by differences of the order below in one direction or the other,
// bounds by dense sampling.
TEST(AbsorptionDerivatives, ByBothFactors) {
  Tissue tissue = testing::literature_choroid();
  tissue.layers[3].scaled_by = ScaledBy::kBeta;
  const AbsorptionLaw law{tissue};
  const FactorRange range{{0.3, 0.5}, {1.7, 2.0}};
  for (const AbsorbedFraction& cell : {law.between(190e-6, 190.2e-6), law.between(195e-6, 196e-6),
                                       law.between(300e-6, 310e-6), law.whole()}) {
    EXPECT_NEAR(derivative(cell, {0, 1}, {0.8, 1.2}), cell.evaluate({0.8, 1.2}).slope[1], 1e-15);
    for (int n = 0; n <= 2; ++n) {
      for (int m = 0; m <= 4; ++m) {
        const double bound = derivative_bound(cell, {n, m}, range);
        for (int i = 0; i <= 40; ++i) {
          for (int j = 0; j <= 40; ++j) {
            const AbsorptionFactors at(0.3 + 0.035 * i, 0.5 + 0.0375 * j);
            ASSERT_LE(std::abs(derivative(cell, {n, m}, at)), bound * (1.0 + 1e-12));
          }
        }
        const double step = 1e-3;
        const auto at = [&](double da, double db) {
          return derivative(cell, {n, m}, {0.8 + da, 1.2 + db});
        };
        EXPECT_NEAR(derivative(cell, {n, m + 1}, {0.8, 1.2}),
                    (at(0.0, step) - at(0.0, -step)) / (2.0 * step), 1e-6 * (bound + 1e-9));
        EXPECT_NEAR(derivative(cell, {n + 1, m}, {0.8, 1.2}),
                    (at(step, 0.0) - at(-step, 0.0)) / (2.0 * step), 1e-6 * (bound + 1e-9));
      }
    }
  }
}

TEST(QDeim, IsExactAtItsDofsAndOnItsBasis) {
  MatrixXd snapshots(80, 20);
  for (int a = 0; a < 20; ++a) {
    for (int i = 0; i < 80; ++i) snapshots(i, a) = std::exp(-(0.2 + 0.1 * a) * 3.0 * i / 80.0);
  }
  const Deim points = q_deim(snapshots, 6);
  ASSERT_EQ(points.dofs.size(), 6U);
  const VectorXd any = VectorXd::LinSpaced(80, -1.0, 2.0).array().sin();
  const VectorXd approximation = points.interpolation * any(points.dofs);
  for (const auto dof : points.dofs) EXPECT_NEAR(approximation[dof], any[dof], 1e-11);
  const VectorXd known = snapshots.col(7);
  EXPECT_LT((points.interpolation * known(points.dofs) - known).norm(), 1e-5 * known.norm());
}

}  // namespace
}  // namespace photocoag
