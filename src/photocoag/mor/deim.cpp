#include "photocoag/mor/deim.hpp"

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd collateral_basis(const MatrixXd& snapshots, int max_terms) {
  const Svd<double> svd = left_svd(snapshots);
  const VectorXd& values = svd.values;
  Index terms = 0;
  while (terms < std::min<Index>(max_terms, values.size()) && values[terms] > 1e-12 * values[0])
    ++terms;
  if (terms == 0) throw Error("DEIM: the snapshots are zero");
  return svd.U.leftCols(terms);
}

MatrixXd interpolation(const MatrixXd& basis, const std::vector<Index>& dofs) {
  const MatrixXd at_dofs = basis(dofs, Eigen::all);
  return solve_from_right(at_dofs, basis);
}

}  // namespace

Deim deim(const MatrixXd& snapshots, int max_terms) {
  const MatrixXd basis = collateral_basis(snapshots, max_terms);
  Deim result;
  for (Index k = 0; k < basis.cols(); ++k) {
    // Residual of interpolating the next basis vector at the dofs found so far; its largest entry
    // is next.
    VectorXd residual = basis.col(k);
    if (k > 0) {
      const MatrixXd at_dofs = basis(result.dofs, Eigen::seqN(0, k));
      const VectorXd wanted = basis.col(k)(result.dofs);
      residual -= basis.leftCols(k) * solve(at_dofs, wanted);
    }
    Index dof = 0;
    residual.cwiseAbs().maxCoeff(&dof);
    result.dofs.push_back(dof);
  }
  result.interpolation = interpolation(basis, result.dofs);
  return result;
}

Deim q_deim(const MatrixXd& snapshots, int max_terms) {
  const MatrixXd basis = collateral_basis(snapshots, max_terms);
  Deim result;
  result.dofs = pivoted_columns(basis.transpose());
  result.dofs.resize(static_cast<std::size_t>(basis.cols()));
  result.interpolation = interpolation(basis, result.dofs);
  return result;
}

}  // namespace photocoag
