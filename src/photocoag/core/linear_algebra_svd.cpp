#include "photocoag/core/linear_algebra.hpp"

#include <Eigen/SVD>

// JacobiSVD preconditions a non-square matrix by a QR. Eigen 3.4 destroys the old QR object before
// it constructs the new one in its place: if that allocation fails, the old one is freed twice and
// the program crashes. Here the QR is made when needed; the numbers are the same. Only this file
// compiles Eigen's SVD, so no other sees the original.
namespace Eigen::internal {

using SvdOfDoubles = JacobiSVD<MatrixXd, ColPivHouseholderQRPreconditioner>;

template <>
class qr_preconditioner_impl<MatrixXd, ColPivHouseholderQRPreconditioner,
                             PreconditionIfMoreRowsThanCols, true> {
 public:
  void allocate(const SvdOfDoubles&) {}
  bool run(SvdOfDoubles& svd, const MatrixXd& A);
};

template <>
class qr_preconditioner_impl<MatrixXd, ColPivHouseholderQRPreconditioner,
                             PreconditionIfMoreColsThanRows, true> {
 public:
  void allocate(const SvdOfDoubles&) {}
  bool run(SvdOfDoubles& svd, const MatrixXd& A);
};

using MoreRows = qr_preconditioner_impl<MatrixXd, ColPivHouseholderQRPreconditioner,
                                        PreconditionIfMoreRowsThanCols, true>;
using MoreColumns = qr_preconditioner_impl<MatrixXd, ColPivHouseholderQRPreconditioner,
                                           PreconditionIfMoreColsThanRows, true>;

// A P = Q R: A's singular values are those of R.
bool MoreRows::run(SvdOfDoubles& svd, const MatrixXd& A) {
  if (A.rows() <= A.cols()) return false;
  const ColPivHouseholderQR<MatrixXd> qr(A);
  svd.m_workMatrix = qr.matrixQR().topRows(A.cols()).triangularView<Upper>();
  if (svd.m_computeFullU) svd.m_matrixU = qr.householderQ();
  if (svd.m_computeThinU) {
    svd.m_matrixU = qr.householderQ() * MatrixXd::Identity(A.rows(), A.cols());
  }
  if (svd.computeV()) svd.m_matrixV = qr.colsPermutation();
  return true;
}

bool MoreColumns::run(SvdOfDoubles& svd, const MatrixXd& A) {
  if (A.cols() <= A.rows()) return false;
  const ColPivHouseholderQR<MatrixXd> qr(A.transpose());
  const MatrixXd R = qr.matrixQR().topRows(A.rows()).triangularView<Upper>();
  svd.m_workMatrix = R.transpose();
  if (svd.m_computeFullV) svd.m_matrixV = qr.householderQ();
  if (svd.m_computeThinV) {
    svd.m_matrixV = qr.householderQ() * MatrixXd::Identity(A.cols(), A.rows());
  }
  if (svd.computeU()) svd.m_matrixU = qr.colsPermutation();
  return true;
}

}  // namespace Eigen::internal

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
