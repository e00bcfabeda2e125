#include "photocoag/mor/parameter_dependence.hpp"

#include <cmath>
#include <numbers>

#include "photocoag/core/error.hpp"
#include "photocoag/mor/deim.hpp"
#include "photocoag/mor/theta_derivatives.hpp"
#include "photocoag/tissue/absorption_derivatives.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLow = 0.2;
constexpr double kHigh = 2.0;
constexpr double kChoroidMargin = 1.25;

// Absorbed fractions per axial cell, in the norm of the energy product (divided by the root of the
// width).
MatrixXd source_snapshots(const FullOrderModel& full,
                          const std::vector<AbsorptionFactors>& factors) {
  const auto& cells = full.cell_absorption();
  MatrixXd snapshots(static_cast<Index>(cells.size()), static_cast<Index>(factors.size()));
  for (Index a = 0; a < snapshots.cols(); ++a) {
    for (Index j = 0; j < snapshots.rows(); ++j) {
      snapshots(j, a) = cells[j].evaluate(factors[a]).value / full.axial().root_measure[j];
    }
  }
  return snapshots;
}

// theta_j(alpha) = absorbed fraction of dof j; sources: what each theta_j stands for.
ParametricSource interpolate_at_cells(const FullOrderModel& full, const Deim& points) {
  ParametricSource result;
  result.theta.kind = ThetaKind::kDeim;
  result.theta.terms = static_cast<int>(points.dofs.size());
  const VectorXd& root = full.axial().root_measure;
  result.sources.resize(full.axial().size(), result.theta.terms);
  for (Index j = 0; j < result.sources.cols(); ++j) {
    const Index dof = points.dofs[j];
    result.theta.points[j] = full.cell_absorption()[dof];
    result.sources.col(j) =
        full.axial_source(VectorXd(points.interpolation.col(j).cwiseProduct(root) / root[dof]));
  }
  return result;
}

// Coefficients of the interpolant at the Chebyshev points of the first kind by their discrete
// orthogonality: c_j = (2 - [j = 0]) / n sum_k f(x_k) T_j(x_k).
ParametricSource chebyshev(const FullOrderModel& full, int terms) {
  ParametricSource result;
  result.theta.kind = ThetaKind::kChebyshev;
  result.theta.terms = terms;
  ThetaFactor& alpha = result.theta.factors[0];
  alpha = {.center = 0.5 * (kLow + kHigh), .half_width = 0.5 * (kHigh - kLow)};
  result.sources = MatrixXd::Zero(full.axial().size(), terms);
  for (int k = 0; k < terms; ++k) {
    const double angle = std::numbers::pi * (k + 0.5) / terms;
    const VectorXd value = full.axial_source(alpha.center + alpha.half_width * std::cos(angle));
    for (int j = 0; j < terms; ++j) {
      result.sources.col(j) += (j == 0 ? 1.0 : 2.0) / terms * std::cos(j * angle) * value;
    }
  }
  return result;
}

// The same in alpha and beta: the terms are split as evenly as possible, alpha getting the larger
// part.
ParametricSource chebyshev(const FullOrderModel& full, int terms, const ChoroidRange& choroid) {
  const int beta_terms = static_cast<int>(std::sqrt(terms));
  const int alpha_terms = terms / beta_terms;
  ParametricSource result;
  Theta& theta = result.theta;
  theta.kind = ThetaKind::kChebyshev;
  theta.terms = alpha_terms * beta_terms;
  auto& [alpha, beta] = theta.factors;
  alpha = {.center = 0.5 * (kLow + kHigh), .half_width = 0.5 * (kHigh - kLow)};
  beta.terms = beta_terms;
  beta.center = 0.5 * (choroid.low / kChoroidMargin + choroid.high * kChoroidMargin);
  beta.half_width = beta.center - choroid.low / kChoroidMargin;
  result.sources = MatrixXd::Zero(full.axial().size(), theta.terms);
  const auto weight = [](int j, int terms_of, double angle) {
    return (j == 0 ? 1.0 : 2.0) / terms_of * std::cos(j * angle);
  };
  for (int l = 0; l < beta_terms; ++l) {
    const double beta_angle = std::numbers::pi * (l + 0.5) / beta_terms;
    for (int k = 0; k < alpha_terms; ++k) {
      const double angle = std::numbers::pi * (k + 0.5) / alpha_terms;
      const VectorXd value = full.axial_source(
          AbsorptionFactors{alpha.center + alpha.half_width * std::cos(angle),
                            beta.center + beta.half_width * std::cos(beta_angle)});
      for (int j = 0; j < theta.terms; ++j) {
        result.sources.col(j) += weight(j % alpha_terms, alpha_terms, angle) *
                                 weight(j / alpha_terms, beta_terms, beta_angle) * value;
      }
    }
  }
  return result;
}

ParametricSource taylor(const FullOrderModel& full, int terms) {
  ParametricSource result;
  result.theta.kind = ThetaKind::kTaylor;
  result.theta.terms = terms;
  result.theta.factors[0].center = kTaylorCenter;
  result.sources.resize(full.axial().size(), terms);
  const auto& cells = full.cell_absorption();
  VectorXd per_cell(static_cast<Index>(cells.size()));
  double factorial = 1.0;
  for (int j = 0; j < terms; ++j) {
    factorial *= j > 0 ? j : 1;
    for (Index c = 0; c < per_cell.size(); ++c) {
      per_cell[c] = derivative(cells[c], {j}, kTaylorCenter) / factorial;
    }
    result.sources.col(j) = full.axial_source(per_cell);
  }
  return result;
}

}  // namespace

std::vector<double> log_spaced(double first, double last, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(first * std::pow(last / first, double(i) / (count - 1)));
  }
  return values;
}

std::vector<double> ChoroidRange::samples(int count, double margin) const {
  if (!free) return {1.0};
  return log_spaced(low / margin, high * margin, count);
}

ChoroidRange choroid_range(const Tissue& tissue, const ReductionSettings& settings) {
  if (!tissue.two_parameters()) return {};
  return {true, settings.choroid_min, settings.choroid_max};
}

std::vector<AbsorptionFactors> tensor(const std::vector<double>& alphas,
                                      const std::vector<double>& betas) {
  std::vector<AbsorptionFactors> factors;
  for (const double beta : betas) {
    for (const double alpha : alphas) factors.emplace_back(alpha, beta);
  }
  return factors;
}

Eigen::VectorXd theta_at(const Theta& theta, AbsorptionFactors at) {
  if (theta.kind == ThetaKind::kTaylor) return theta_derivative(theta, {}, at.alpha);
  TermVector value;
  TermSlopes slope;
  if (theta.kind == ThetaKind::kDeim || theta.terms_of(1) > 1) {
    theta.evaluate(at, value, slope);
  } else {
    theta.evaluate(at.alpha, value, slope[0]);
  }
  return value;
}

ParametricSource parametric_source(const FullOrderModel& full, ParameterDependence dependence,
                                   int terms, const ChoroidRange& choroid) {
  // Over the estimator's widest range of alpha, so that theta is accurate wherever the filter may
  // go.
  const auto snapshots = [&] {
    return source_snapshots(full, tensor(log_spaced(kLow, kHigh, choroid.free ? 15 : 40),
                                         choroid.samples(7, kChoroidMargin)));
  };
  switch (dependence) {
    case ParameterDependence::kChebyshev:
      return choroid.free ? chebyshev(full, terms, choroid) : chebyshev(full, terms);
    case ParameterDependence::kTaylor:
      if (choroid.free) {
        throw Error(ErrorParts{.key = "model.parameter_dependence",
                               .problem = "the Taylor series is in alpha alone, and a layer of "
                                          "[tissue] has scaled_by = \"beta\"",
                               .found = "\"taylor\"",
                               .accepted = "\"deim\", \"q-deim\" or \"chebyshev\", and another "
                                           "model.method than \"taylor\""});
      }
      return taylor(full, terms);
    case ParameterDependence::kQDeim:
      return interpolate_at_cells(full, q_deim(snapshots(), terms));
    case ParameterDependence::kDeim:
      break;
  }
  return interpolate_at_cells(full, deim(snapshots(), terms));
}

}  // namespace photocoag
