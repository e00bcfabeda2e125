#include "photocoag/core/linear_algebra.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <unsupported/Eigen/MatrixFunctions>

namespace photocoag {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

QrFactors qr(const MatrixXd& A) {
  const Eigen::HouseholderQR<MatrixXd> qr(A);
  const Index rank = std::min(A.rows(), A.cols());
  return {qr.householderQ() * MatrixXd::Identity(A.rows(), rank),
          qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>()};
}

MatrixXd column_basis(const MatrixXd& A, double threshold) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  qr.setThreshold(threshold);
  return qr.householderQ() * MatrixXd::Identity(A.rows(), qr.rank());
}

std::vector<Index> pivoted_columns(const MatrixXd& A) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  const auto& indices = qr.colsPermutation().indices();
  return {indices.begin(), indices.end()};
}

VectorXd least_squares(const MatrixXd& A, const VectorXd& b) {
  return A.colPivHouseholderQr().solve(b);
}

MatrixXd least_squares(const MatrixXd& A, const MatrixXd& B) {
  return A.colPivHouseholderQr().solve(B);
}

LuFactors::LuFactors(const MatrixXd& A) {
  const Eigen::PartialPivLU<MatrixXd> lu(A);
  P_ = lu.permutationP();
  LU_ = lu.matrixLU();
}

VectorXd LuFactors::solve(const VectorXd& b) const {
  VectorXd x = P_ * b;
  LU_.triangularView<Eigen::UnitLower>().solveInPlace(x);
  LU_.triangularView<Eigen::Upper>().solveInPlace(x);
  return x;
}

VectorXd solve(const MatrixXd& A, const VectorXd& b) { return A.partialPivLu().solve(b); }

MatrixXcd solve(const MatrixXcd& A, const MatrixXcd& B) { return A.partialPivLu().solve(B); }

VectorXd solve_transposed(const MatrixXd& A, const VectorXd& b) {
  return A.transpose().partialPivLu().solve(b);
}

MatrixXd solve_from_right(const MatrixXd& A, const MatrixXd& B) {
  return A.transpose().partialPivLu().solve(B.transpose()).transpose();
}

MatrixXd inverse(const MatrixXd& A) { return A.partialPivLu().inverse(); }

MatrixXd exponential(const MatrixXd& A) { return A.exp(); }

std::optional<MatrixXd> cholesky(const MatrixXd& A) {
  const Eigen::LLT<MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) return std::nullopt;
  return factor.matrixL();
}

bool cholesky_diagonal(const InputMatrix& A, InputVector& diagonal) noexcept {
  const Eigen::LLT<InputMatrix> factor(A);
  if (factor.info() != Eigen::Success) return false;
  diagonal = factor.matrixLLT().diagonal();
  return true;
}

MatrixXd solve_lower(const MatrixXd& L, const MatrixXd& B) {
  return L.triangularView<Eigen::Lower>().solve(B);
}

VectorXd solve_lower(const MatrixXd& L, const VectorXd& b) {
  return L.triangularView<Eigen::Lower>().solve(b);
}

MatrixXd solve_lower_transposed(const MatrixXd& L, const MatrixXd& B) {
  return L.transpose().triangularView<Eigen::Upper>().solve(B);
}

VectorXd solve_symmetric(const MatrixXd& A, const VectorXd& b) { return A.ldlt().solve(b); }

MatrixXd solve_symmetric_from_right(const MatrixXd& A, const MatrixXd& B) {
  return A.ldlt().solve(B.transpose()).transpose();
}

}  // namespace photocoag
