#include "photocoag/core/linear_algebra.hpp"

#include <Eigen/Eigenvalues>
#include <limits>

namespace photocoag {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <typename Matrix>
SymmetricEigen<typename Matrix::Scalar> taken(const Eigen::SelfAdjointEigenSolver<Matrix>& eigen) {
  return {eigen.eigenvalues(), eigen.eigenvectors(), eigen.info() == Eigen::Success};
}

}  // namespace

SymmetricEigen<double> symmetric_eigen(const MatrixXd& A) {
  return taken(Eigen::SelfAdjointEigenSolver<MatrixXd>(A));
}

SymmetricEigen<long double> symmetric_eigen(const LongMatrix& A) {
  return taken(Eigen::SelfAdjointEigenSolver<LongMatrix>(A));
}

VectorXd symmetric_eigenvalues(const MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

SymmetricEigen<double> tridiagonal_eigen(const VectorXd& diagonal, const VectorXd& off_diagonal) {
  Eigen::SelfAdjointEigenSolver<MatrixXd> eigen;
  eigen.computeFromTridiagonal(diagonal, off_diagonal, Eigen::ComputeEigenvectors);
  return taken(eigen);
}

GeneralEigen general_eigen(const MatrixXd& A) {
  const Eigen::EigenSolver<MatrixXd> eigen(A);
  if (eigen.info() == Eigen::Success) return {eigen.eigenvalues(), eigen.eigenvectors(), true};
  return {VectorXcd::Constant(A.rows(), kNaN), MatrixXcd::Constant(A.rows(), A.cols(), kNaN)};
}

VectorXcd general_eigenvalues(const MatrixXd& A) {
  const Eigen::EigenSolver<MatrixXd> eigen(A, false);
  if (eigen.info() == Eigen::Success) return eigen.eigenvalues();
  return VectorXcd::Constant(A.rows(), kNaN);
}

}  // namespace photocoag
