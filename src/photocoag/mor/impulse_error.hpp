// Role: offline; e_k(alpha, beta) = full-order minus reduced impulse response as sums over modes,
// with bounds between nodes of alpha and beta. Used by the certificate. Source: docs/models.md
// (certificate). Units: K/W; the volume temperature before any normalisation.
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>

#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/factor_nodes.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Bounds of d4/dalpha4, d4/dalpha2 dbeta2 and d4/dbeta4. The latter two stay 0 for one parameter.
struct FourthBounds {
  Eigen::VectorXd alpha;  ///< per term
  Eigen::VectorXd mixed;
  Eigen::VectorXd beta;
};

/// What depends on alpha and beta, and its derivatives; those by beta are empty for one parameter.
template <typename Matrix>
struct FactorDerivatives {
  Matrix value;
  Matrix alpha;
  Matrix alpha_alpha;
  Matrix beta;
  Matrix beta_beta;
};

/// Bounds of derivatives, [n][m]: n times by alpha, m times by beta; empty where not needed.
using DerivativeBounds = std::array<std::array<Eigen::VectorXd, 5>, 5>;

/// One output as a sum over terms, sum_j value(node, j) x_j(k), where only the factors of x_j
/// depend on alpha and beta. Second derivatives are exact; fourth derivatives and values are
/// bounded over the whole range, term by term.
template <typename Scalar>
struct OutputExpansion {
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  Matrix value;           ///< nodes x terms
  Matrix second_alpha;    ///< d2 / dalpha2
  Matrix second_beta;     ///< d2 / dbeta2; empty for one parameter
  Eigen::VectorXd bound;  ///< per term, of |value|
  FourthBounds fourth;
};

template <typename Scalar>
struct ErrorExpansion {
  OutputExpansion<Scalar> peak;
  OutputExpansion<Scalar> volume;
};

/// The full-order model over the axial modes of one group of radial modes, x_j: AxialProfiles.
class FullExpansion {
 public:
  /// The sources at the nodes, in a basis (to rounding) where over() is asked for many groups, as
  /// it is if `full` is not separable. Keeps a reference to `full`. Allocates.
  FullExpansion(const FullOrderModel& full, const FactorNodes& nodes);

  /// `vectors`: U, cells x modes; `peak`: axial coordinates of the peak's evaluation. Allocates.
  ErrorExpansion<double> over(const Eigen::MatrixXd& vectors, const Eigen::VectorXd& peak) const;

 private:
  const FullOrderModel& full_;
  FactorNodes nodes_;
  FactorDerivatives<Eigen::MatrixXd>
      source_;              // cells x nodes, per root measure; or basis_ times it
  Eigen::MatrixXd basis_;   // of all sources, cells x about 20; else empty
  DerivativeBounds bound_;  // per cell
};

/// The reduced model over the eigenvalues of A_d, x_i = lambda_i^(k-1), the output being the real
/// part of the sum.
struct ReducedExpansion {
  ErrorExpansion<std::complex<double>> outputs;
  Eigen::VectorXcd decay;  ///< lambda_i
};

/// Throws Error if A_d has no well-conditioned eigenvectors. Allocates.
ReducedExpansion expand_reduced(const ReducedModel& reduced, const FactorNodes& nodes);

}  // namespace photocoag
