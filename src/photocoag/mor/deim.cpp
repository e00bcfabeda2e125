#include "photocoag/mor/deim.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "photocoag/core/error.hpp"

namespace photocoag {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd collateral_basis(const MatrixXd& snapshots, int max_terms) {
  const Eigen::JacobiSVD<MatrixXd> svd(snapshots, Eigen::ComputeThinU);
  const VectorXd& values = svd.singularValues();
  Index terms = 0;
  while (terms < std::min<Index>(max_terms, values.size()) && values[terms] > 1e-12 * values[0])
    ++terms;
  if (terms == 0) throw Error("DEIM: the snapshots are zero");
  return svd.matrixU().leftCols(terms);
}

MatrixXd interpolation(const MatrixXd& basis, const std::vector<Index>& dofs) {
  const MatrixXd at_dofs = basis(dofs, Eigen::all);
  return at_dofs.transpose().partialPivLu().solve(basis.transpose()).transpose();
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
      residual -= basis.leftCols(k) * at_dofs.partialPivLu().solve(wanted);
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
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(basis.transpose());
  Deim result;
  for (Index k = 0; k < basis.cols(); ++k) {
    result.dofs.push_back(qr.colsPermutation().indices()[k]);
  }
  result.interpolation = interpolation(basis, result.dofs);
  return result;
}

}  // namespace photocoag
