#include "photocoag/core/linear_algebra.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <new>
#include <numbers>

#include "support/heap_guard.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Well conditioned, without symmetry; the same in every run.
MatrixXd sample(Index rows, Index columns) {
  MatrixXd A(rows, columns);
  for (Index i = 0; i < rows; ++i) {
    for (Index j = 0; j < columns; ++j) {
      A(i, j) = std::sin(1.0 + 3.0 * double(i) + 7.0 * double(j * j)) + (i == j ? 4.0 : 0.0);
    }
  }
  return A;
}

MatrixXd positive(Index size) {
  const MatrixXd A = sample(size, size);
  return A * A.transpose();
}

// Sizes up to 20: a few hundred roundings of numbers of order 10.
constexpr double kRounding = 1e-11;

double difference(const MatrixXd& a, const MatrixXd& b) { return (a - b).cwiseAbs().maxCoeff(); }
bool orthonormal(const MatrixXd& Q) {
  return difference(Q.transpose() * Q, MatrixXd::Identity(Q.cols(), Q.cols())) < kRounding;
}

TEST(LinearAlgebra, SingularValueDecompositionsGiveTheMatrixBack) {
  for (const MatrixXd& A : {sample(20, 7), sample(7, 20), sample(9, 9)}) {
    for (const Svd<double>& f : {svd(A), large_svd(A)}) {
      EXPECT_LT(difference(f.U * f.values.asDiagonal() * f.V.transpose(), A), kRounding);
      EXPECT_TRUE(orthonormal(f.U) && orthonormal(f.V));
      EXPECT_LT(difference(f.values, singular_values(A)), kRounding);
      EXPECT_TRUE((f.values.head(6).array() >= f.values.segment(1, 6).array()).all());
    }
    EXPECT_LT(difference(left_svd(A).U, svd(A).U), kRounding);
  }
  const LongMatrix L = sample(8, 8).cast<long double>();
  const Svd<long double> f = square_svd(L);
  EXPECT_LT((f.U * f.values.asDiagonal() * f.V.transpose() - L).cwiseAbs().maxCoeff(), 1e-15L);
  const MatrixXcd turned = std::complex<double>(0.6, 0.8) * sample(6, 6);
  EXPECT_LT(difference(square_singular_values(turned), singular_values(sample(6, 6))), kRounding);
}

// Every allocation of `decompose` refused, one per call: std::bad_alloc, nothing freed twice (glibc
// or the sanitizer ends the program then). Returns how many there are.
template <typename Decompose>
int refused_one_by_one(const Decompose& decompose) {
  for (int number = 1;; ++number) {
    const testing::RefusedAllocation refused(number);
    try {
      decompose();
      if (!refused.met()) return number - 1;
    } catch (const std::bad_alloc&) {
      if (!refused.met()) return -1;
    }
  }
}

TEST(LinearAlgebra, RefusedMemoryInsideASingularValueDecompositionIsAnException) {
  // The last is larger than what divide and conquer leaves to Jacobi's rotations.
  for (const MatrixXd& A : {sample(20, 7), sample(7, 20), sample(60, 40)}) {
    EXPECT_GT(refused_one_by_one([&] { svd(A); }), 5);
    EXPECT_GT(refused_one_by_one([&] { left_svd(A); }), 5);
    EXPECT_GT(refused_one_by_one([&] { singular_values(A); }), 5);
    EXPECT_GT(refused_one_by_one([&] { large_svd(A); }), 5);
    EXPECT_GT(
        refused_one_by_one([&] { shortest_least_squares(A, VectorXd::Ones(A.rows()), 1e-8); }), 5);
  }
}

TEST(LinearAlgebra, SymmetricEigenvectorsGiveTheMatrixBack) {
  const MatrixXd A = positive(12);
  const SymmetricEigen<double> f = symmetric_eigen(A);
  EXPECT_TRUE(f.converged && orthonormal(f.vectors));
  EXPECT_LT(difference(f.vectors * f.values.asDiagonal() * f.vectors.transpose(), A), 1e-10);
  EXPECT_LT(difference(symmetric_eigenvalues(A), f.values), 1e-10);
  const LongVector exact = symmetric_eigen(LongMatrix(A.cast<long double>())).values;
  EXPECT_LT(difference(exact.cast<double>(), f.values), 1e-10);
  // Second differences of n points: 2 - 2 cos(k pi / (n + 1)).
  const Index n = 15;
  const SymmetricEigen<double> chain =
      tridiagonal_eigen(VectorXd::Constant(n, 2.0), VectorXd::Constant(n - 1, -1.0));
  for (Index k = 0; k < n; ++k) {
    EXPECT_NEAR(chain.values[k], 2.0 - 2.0 * std::cos(double(k + 1) * std::numbers::pi / (n + 1)),
                kRounding);
  }
}

TEST(LinearAlgebra, GeneralEigenvectorsAreEigenvectors) {
  const MatrixXd A = sample(10, 10);
  const GeneralEigen f = general_eigen(A);
  ASSERT_TRUE(f.converged);
  const MatrixXcd off =
      A.cast<std::complex<double>>() * f.vectors - f.vectors * f.values.asDiagonal();
  EXPECT_LT(off.cwiseAbs().maxCoeff(), kRounding);
  EXPECT_LT((general_eigenvalues(A) - f.values).cwiseAbs().maxCoeff(), kRounding);
  const MatrixXd bad = MatrixXd::Constant(3, 3, std::nan(""));
  EXPECT_FALSE(general_eigen(bad).converged);
  EXPECT_TRUE(std::isnan(general_eigenvalues(bad)[0].real()));
}

TEST(LinearAlgebra, OrthogonalFactorsSpanTheColumns) {
  for (const MatrixXd& A : {sample(20, 6), sample(6, 20)}) {
    const auto [Q, R] = qr(A);
    EXPECT_TRUE(orthonormal(Q));
    EXPECT_LT(difference(Q * R, A), kRounding);
    EXPECT_EQ(R(1, 0), 0.0);
  }
  MatrixXd dependent(20, 8);
  dependent << sample(20, 4), 2.0 * sample(20, 4);
  const MatrixXd basis = column_basis(dependent, 1e-10);
  ASSERT_EQ(basis.cols(), 4);
  EXPECT_LT(difference(basis * (basis.transpose() * dependent), dependent), kRounding);
  MatrixXd columns = MatrixXd::Identity(5, 5);
  columns.diagonal() << 1.0, 5.0, 3.0, 2.0, 4.0;
  EXPECT_EQ(pivoted_columns(columns), (std::vector<Index>{1, 4, 2, 3, 0}));
}

TEST(LinearAlgebra, LeastSquaresLeaveAnErrorOrthogonalToTheColumns) {
  const MatrixXd A = sample(20, 5);
  const VectorXd b = sample(20, 1);
  EXPECT_LT((A.transpose() * (A * least_squares(A, b) - b)).cwiseAbs().maxCoeff(), kRounding);
  EXPECT_LT(difference(least_squares(A, MatrixXd(b)), least_squares(A, b)), kRounding);
  MatrixXd twice(20, 2);
  twice << A.col(0), A.col(0);
  const VectorXd x = shortest_least_squares(twice, A.col(0), 1e-8);
  EXPECT_LT((x - VectorXd::Constant(2, 0.5)).norm(), kRounding);
}

TEST(LinearAlgebra, SolutionsSolve) {
  const MatrixXd A = sample(9, 9);
  const MatrixXd B = sample(4, 9);
  const VectorXd b = sample(9, 1);
  EXPECT_LT(difference(A * solve(A, b), b), kRounding);
  EXPECT_LT(difference(A * LuFactors(A).solve(b), b), kRounding);
  EXPECT_LT(difference(A.transpose() * solve_transposed(A, b), b), kRounding);
  EXPECT_LT(difference(solve_from_right(A, B) * A, B), kRounding);
  EXPECT_LT(difference(A * inverse(A), MatrixXd::Identity(9, 9)), kRounding);
  const MatrixXcd C = std::complex<double>(0.6, 0.8) * A;
  const MatrixXcd right = A.cast<std::complex<double>>();
  EXPECT_LT((C * solve(C, right) - right).cwiseAbs().maxCoeff(), kRounding);
  const MatrixXd P = positive(9);
  EXPECT_LT(difference(P * solve_symmetric(P, b), b), 1e-10);
  EXPECT_LT(difference(solve_symmetric_from_right(P, B) * P, B), 1e-10);
}

TEST(LinearAlgebra, ARowThatIsThereTwiceLeavesAFreeUnknownAtZero) {
  LongMatrix A = sample(6, 6).cast<long double>();
  A.row(5) = A.row(2);
  A.col(5) = A.col(1);
  const LongVector x = LongVector::LinSpaced(6, 1.0L, 2.0L);
  const LongVector b = A * x;
  const LongVector found = solve_rank_revealing(A, b, 1e-15L);
  EXPECT_LT((A * found - b).cwiseAbs().maxCoeff(), 1e-16L);
  EXPECT_EQ(found.cwiseAbs().minCoeff(), 0.0L);
}

TEST(LinearAlgebra, CholeskyFactorsArePositiveDefiniteMatricesOnly) {
  const MatrixXd P = positive(9);
  const std::optional<MatrixXd> L = cholesky(P);
  ASSERT_TRUE(L);
  EXPECT_LT(difference(*L * L->transpose(), P), 1e-10);
  EXPECT_EQ((*L)(0, 1), 0.0);
  const MatrixXd B = sample(9, 3);
  EXPECT_LT(difference(*L * solve_lower(*L, B), B), kRounding);
  EXPECT_LT(difference(*L * solve_lower(*L, VectorXd(B.col(1))), B.col(1)), kRounding);
  EXPECT_LT(difference(L->transpose() * solve_lower_transposed(*L, B), B), kRounding);
  EXPECT_FALSE(cholesky(P - 1e3 * MatrixXd::Identity(9, 9)));
}

TEST(LinearAlgebra, PivotsOfABoundedMatrixTakeNothingFromTheHeap) {
  InputMatrix A = positive(kMaxInputs);
  InputVector diagonal;
  const testing::HeapGuard guard;
  const bool definite = cholesky_diagonal(A, diagonal);
  A(20, 20) = -1.0;
  const bool indefinite = cholesky_diagonal(A, diagonal);
  const testing::HeapUse use = guard.use();
  EXPECT_EQ(use, testing::HeapUse{});
  EXPECT_TRUE(definite);
  EXPECT_FALSE(indefinite);
}

TEST(LinearAlgebra, TheExponentialOfARotationsGeneratorRotates) {
  MatrixXd A = MatrixXd::Zero(2, 2);
  A(0, 1) = -1.2;
  A(1, 0) = 1.2;
  MatrixXd turned(2, 2);
  turned << std::cos(1.2), -std::sin(1.2), std::sin(1.2), std::cos(1.2);
  EXPECT_LT(difference(exponential(A), turned), 1e-14);
}

}  // namespace
}  // namespace photocoag
