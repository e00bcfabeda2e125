#include "photocoag/core/linear_algebra.hpp"

#include <Eigen/SVD>

namespace photocoag {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A square matrix needs no QR first; less to compile, the same numbers.
template <typename Matrix>
using Square = Eigen::JacobiSVD<Matrix, Eigen::NoQRPreconditioner>;

Svd<double> svd(const MatrixXd& A) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

Svd<long double> square_svd(const LongMatrix& A) {
  const Square<LongMatrix> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

Svd<double> left_svd(const MatrixXd& A) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeThinU);
  return {svd.matrixU(), svd.singularValues(), {}};
}

VectorXd singular_values(const MatrixXd& A) {
  return Eigen::JacobiSVD<MatrixXd>(A).singularValues();
}

VectorXd square_singular_values(const MatrixXcd& A) {
  return Square<MatrixXcd>(A).singularValues();
}

Svd<double> large_svd(const MatrixXd& A) {
  const Eigen::BDCSVD<MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

VectorXd shortest_least_squares(const MatrixXd& A, const VectorXd& b, double threshold) {
  return Eigen::BDCSVD<MatrixXd>(A, Eigen::ComputeThinU | Eigen::ComputeThinV)
      .setThreshold(threshold)
      .solve(b);
}

}  // namespace photocoag
