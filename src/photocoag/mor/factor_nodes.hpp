// Role: offline; nodes over alpha and beta, and bounds that hold between them. Used by the
// certificate. Source: docs/models.md (certificate, between nodes). Units: 1.
#pragma once

#include <Eigen/Core>

#include "photocoag/core/types.hpp"
#include "photocoag/tissue/absorption_derivatives.hpp"

namespace photocoag {

/// Equidistant alphas times equidistant betas; node (a, b) has the index b * alphas + a. A cell
/// lies between neighbours: two nodes if there is one beta, else four.
class FactorNodes {
 public:
  /// At least two alphas; `betas` = 1 if beta is no parameter. Throws Error.
  FactorNodes(const FactorRange& range, int alphas, int betas);

  const Eigen::VectorXd& alphas() const noexcept { return alpha_; }
  Eigen::Index size() const noexcept { return alpha_.size() * beta_.size(); }
  bool two_parameters() const noexcept { return beta_.size() > 1; }
  AbsorptionFactors at(Eigen::Index node) const noexcept {
    return {alpha_[node % alpha_.size()], beta_[node / alpha_.size()]};
  }
  FactorRange range() const noexcept;
  /// h^2 / 8 in direction 0 (alpha) or 1 (beta; 0 if it is no parameter): the error of linear
  /// interpolation is at most this times the largest second derivative.
  double factor(int direction) const noexcept { return factor_[direction]; }

  /// Largest value at the nodes of each cell.
  Eigen::VectorXd to_cells(const Eigen::VectorXd& at_nodes) const;
  /// Smallest value at the nodes of each cell.
  Eigen::VectorXd least_in_cells(const Eigen::VectorXd& at_nodes) const;
  /// Largest value of the cells around each node: its linear interpolant lies above each cell's
  /// value throughout the cell.
  Eigen::VectorXd to_nodes(const Eigen::VectorXd& per_cell) const;
  /// Largest value over all betas, for each alpha.
  Eigen::VectorXd over_beta(const Eigen::VectorXd& at_nodes) const;

 private:
  Eigen::VectorXd alpha_;
  Eigen::VectorXd beta_;
  double factor_[2];
};

}  // namespace photocoag
