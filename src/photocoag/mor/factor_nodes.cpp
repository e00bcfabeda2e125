#include "photocoag/mor/factor_nodes.hpp"

#include <algorithm>

#include "photocoag/core/error.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double interpolation_factor(const VectorXd& nodes) {
  if (nodes.size() < 2) return 0.0;
  const double spacing = nodes[1] - nodes[0];
  return spacing * spacing / 8.0;
}

// Entry i and its neighbour behind it, along the first direction.
MatrixXd larger_of_neighbours(const MatrixXd& m) {
  const Index n = m.rows();
  if (n == 1) return m;
  return m.topRows(n - 1).cwiseMax(m.bottomRows(n - 1));
}

// The one or two intervals next to each node, along the first direction.
MatrixXd larger_of_intervals(const MatrixXd& m, Index nodes) {
  if (nodes == 1) return m;
  MatrixXd result(nodes, m.cols());
  for (Index i = 0; i < nodes; ++i) {
    result.row(i) = m.row(std::max<Index>(i - 1, 0)).cwiseMax(m.row(std::min<Index>(i, nodes - 2)));
  }
  return result;
}

}  // namespace

FactorNodes::FactorNodes(const FactorRange& range, int alphas, int betas) {
  if (alphas < 2 || betas < 1) throw Error("nodes of alpha and beta: at least two, at least one");
  alpha_ = VectorXd::LinSpaced(alphas, range.low.alpha, range.high.alpha);
  beta_ = betas == 1 ? VectorXd::Constant(1, range.low.beta)
                     : VectorXd(VectorXd::LinSpaced(betas, range.low.beta, range.high.beta));
  factor_[0] = interpolation_factor(alpha_);
  factor_[1] = interpolation_factor(beta_);
}

FactorRange FactorNodes::range() const noexcept { return {at(0), at(size() - 1)}; }

VectorXd FactorNodes::to_cells(const VectorXd& at_nodes) const {
  const MatrixXd along_alpha = larger_of_neighbours(at_nodes.reshaped(alpha_.size(), beta_.size()));
  return larger_of_neighbours(along_alpha.transpose()).transpose().reshaped();
}

VectorXd FactorNodes::least_in_cells(const VectorXd& at_nodes) const {
  return -to_cells(-at_nodes);
}

VectorXd FactorNodes::to_nodes(const VectorXd& per_cell) const {
  const Index betas = std::max<Index>(beta_.size() - 1, 1);
  const MatrixXd along_alpha =
      larger_of_intervals(per_cell.reshaped(alpha_.size() - 1, betas), alpha_.size());
  return larger_of_intervals(along_alpha.transpose(), beta_.size()).transpose().reshaped();
}

VectorXd FactorNodes::over_beta(const VectorXd& at_nodes) const {
  return at_nodes.reshaped(alpha_.size(), beta_.size()).rowwise().maxCoeff();
}

}  // namespace photocoag
