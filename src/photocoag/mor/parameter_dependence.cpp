#include "photocoag/mor/parameter_dependence.hpp"

#include <cmath>
#include <numbers>

#include "photocoag/mor/deim.hpp"
#include "photocoag/tissue/absorption_derivatives.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLow = 0.2;
constexpr double kHigh = 2.0;

// Absorbed fractions per axial cell, in the norm of the energy product (divided by the root of the
// width).
MatrixXd source_snapshots(const FullOrderModel& full, const std::vector<double>& alphas) {
  const auto& cells = full.cell_absorption();
  MatrixXd snapshots(static_cast<Index>(cells.size()), static_cast<Index>(alphas.size()));
  for (Index a = 0; a < snapshots.cols(); ++a) {
    for (Index j = 0; j < snapshots.rows(); ++j) {
      snapshots(j, a) = cells[j].evaluate(alphas[a]).value / full.axial().root_measure[j];
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
  result.theta.center = 0.5 * (kLow + kHigh);
  result.theta.half_width = 0.5 * (kHigh - kLow);
  result.sources = MatrixXd::Zero(full.axial().size(), terms);
  for (int k = 0; k < terms; ++k) {
    const double angle = std::numbers::pi * (k + 0.5) / terms;
    const VectorXd value =
        full.axial_source(result.theta.center + result.theta.half_width * std::cos(angle));
    for (int j = 0; j < terms; ++j) {
      result.sources.col(j) += (j == 0 ? 1.0 : 2.0) / terms * std::cos(j * angle) * value;
    }
  }
  return result;
}

ParametricSource taylor(const FullOrderModel& full, int terms) {
  ParametricSource result;
  result.theta.kind = ThetaKind::kTaylor;
  result.theta.terms = terms;
  result.theta.center = kTaylorCenter;
  result.sources.resize(full.axial().size(), terms);
  const auto& cells = full.cell_absorption();
  VectorXd per_cell(static_cast<Index>(cells.size()));
  double factorial = 1.0;
  for (int j = 0; j < terms; ++j) {
    factorial *= j > 0 ? j : 1;
    for (Index c = 0; c < per_cell.size(); ++c) {
      per_cell[c] = derivative(cells[c], j, kTaylorCenter) / factorial;
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

ParametricSource parametric_source(const FullOrderModel& full, ParameterDependence dependence,
                                   int terms) {
  switch (dependence) {
    case ParameterDependence::kChebyshev:
      return chebyshev(full, terms);
    case ParameterDependence::kTaylor:
      return taylor(full, terms);
    case ParameterDependence::kQDeim:
      return interpolate_at_cells(
          full, q_deim(source_snapshots(full, log_spaced(kLow, kHigh, 40)), terms));
    case ParameterDependence::kDeim:
      break;
  }
  // Over the estimator's widest range of alpha, so that theta is right wherever the filter may
  // look.
  return interpolate_at_cells(full,
                              deim(source_snapshots(full, log_spaced(kLow, kHigh, 40)), terms));
}

}  // namespace photocoag
