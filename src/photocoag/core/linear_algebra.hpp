// Role: setup; matrix decompositions. The only place that compiles Eigen's, which cost seconds in
// every file that includes them (enforced by tests/architecture). Used by all setup code. Source:
// G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed.; Eigen 3.4. Real time: no, except
// cholesky_diagonal.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "photocoag/core/types.hpp"

namespace photocoag {

/// Where double precision is not enough.
using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using LongVector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

// Singular values: A = U diag(values) V', values descending, as many as the shorter side of A.

template <typename Scalar>
struct Svd {
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> U;
  Eigen::Matrix<Scalar, Eigen::Dynamic, 1> values;
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> V;
};

/// By Jacobi rotations: small singular values are accurate too.
Svd<double> svd(const Eigen::MatrixXd& A);
/// The same for a square matrix.
Svd<long double> square_svd(const LongMatrix& A);
/// Without V.
Svd<double> left_svd(const Eigen::MatrixXd& A);
Eigen::VectorXd singular_values(const Eigen::MatrixXd& A);
Eigen::VectorXd square_singular_values(const Eigen::MatrixXcd& A);
/// By divide and conquer: faster from about 16 columns on.
Svd<double> large_svd(const Eigen::MatrixXd& A);
/// The minimum-norm x that minimises |A x - b|; singular values below `threshold` times the
/// largest count as 0.
Eigen::VectorXd shortest_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                       double threshold);

// Eigenvalues.

/// A = vectors diag(values) vectors', values ascending.
template <typename Scalar>
struct SymmetricEigen {
  Eigen::Matrix<Scalar, Eigen::Dynamic, 1> values;
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> vectors;
  bool converged = false;
};

/// Of a symmetric A; only its lower triangle is read.
SymmetricEigen<double> symmetric_eigen(const Eigen::MatrixXd& A);
SymmetricEigen<long double> symmetric_eigen(const LongMatrix& A);
/// Without vectors.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& A);
/// Of a symmetric tridiagonal matrix.
SymmetricEigen<double> tridiagonal_eigen(const Eigen::VectorXd& diagonal,
                                         const Eigen::VectorXd& off_diagonal);

/// A vectors = vectors diag(values), unordered; unit vectors. All NaN if not converged.
struct GeneralEigen {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
  bool converged = false;
};

GeneralEigen general_eigen(const Eigen::MatrixXd& A);
/// Without vectors; NaN if not converged.
Eigen::VectorXcd general_eigenvalues(const Eigen::MatrixXd& A);

// Orthogonal factors.

/// A = Q R: Q with orthonormal columns, as many as the shorter side of A; R upper triangular.
struct QrFactors {
  Eigen::MatrixXd Q;
  Eigen::MatrixXd R;
};

QrFactors qr(const Eigen::MatrixXd& A);
/// An orthonormal basis of A's column space; pivots below `threshold` times the largest are
/// dropped.
Eigen::MatrixXd column_basis(const Eigen::MatrixXd& A, double threshold);
/// The columns of A in the order in which a pivoted QR takes them.
std::vector<Eigen::Index> pivoted_columns(const Eigen::MatrixXd& A);
/// x with least |A x - b|, A of full column rank.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

// Square systems; the matrix is non-singular.

/// P A = L U, L and U in one matrix.
class LuFactors {
 public:
  explicit LuFactors(const Eigen::MatrixXd& A);
  /// A^-1 b.
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

 private:
  Eigen::PermutationMatrix<Eigen::Dynamic> P_;
  Eigen::MatrixXd LU_;
};

/// A^-1 b.
Eigen::VectorXd solve(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::MatrixXcd solve(const Eigen::MatrixXcd& A, const Eigen::MatrixXcd& B);
/// A'^-1 b.
Eigen::VectorXd solve_transposed(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
/// B A^-1.
Eigen::MatrixXd solve_from_right(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);
/// A^-1 b with one step of iterative refinement; where A is singular, pivots below `threshold`
/// times the largest count as 0 and their unknowns are 0.
LongVector solve_rank_revealing(const LongMatrix& A, const LongVector& b, long double threshold);
/// e^A.
Eigen::MatrixXd exponential(const Eigen::MatrixXd& A);

// Symmetric, positive definite systems; only the lower triangle of A is read.

/// Lower triangular L with A = L L', or nothing if A is not positive definite.
std::optional<Eigen::MatrixXd> cholesky(const Eigen::MatrixXd& A);
/// The diagonal of L, or false if A is not positive definite. Bounded, noexcept, no allocation.
bool cholesky_diagonal(const InputMatrix& A, InputVector& diagonal) noexcept;
/// L^-1 B and L'^-1 B of a lower triangular L.
Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& L, const Eigen::MatrixXd& B);
Eigen::VectorXd solve_lower(const Eigen::MatrixXd& L, const Eigen::VectorXd& b);
Eigen::MatrixXd solve_lower_transposed(const Eigen::MatrixXd& L, const Eigen::MatrixXd& B);
/// A^-1 b and B A^-1 of a symmetric A, which may be nearly singular (L D L').
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
Eigen::MatrixXd solve_symmetric_from_right(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

}  // namespace photocoag
