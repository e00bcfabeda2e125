// Role: offline; an intermediate model, accurate to about 1e-5, from which bases are made. Used by
// mor. Source: method of snapshots (Sirovich 1987); docs/equations.md (E12). Why: the span of all
// impulse responses e^(At) B(alpha) is nearly 100-dimensional. Projected on it, every later step
// (pulse responses, POD, choice of weights) costs microseconds instead of passes over n > 80,000
// states. Units: SI.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "photocoag/fom/full_order_model.hpp"

namespace photocoag {

/// Galerkin projection of the full-order model on the span of its impulse responses, in coordinates
/// in which A is diagonal and the basis orthonormal in the energy product.
struct ImpulseSpace {
  Eigen::VectorXd rates;         ///< 1/s; A = -diag(rates), ascending
  Eigen::MatrixXd axial_source;  ///< size x axial modes: V'(beam (x) .), so that
                                 ///< B(alpha) = input_gain * axial_source * source(alpha)
  Eigen::VectorXd peak;          ///< C_peak V
  /// V x: a state of this space as coordinates of the full-order model, radial x axial modes. V
  /// itself, n x size numbers, is never stored: its columns are sums of tensor products.
  std::function<Eigen::MatrixXd(const Eigen::VectorXd& state)> lift;

  Eigen::Index size() const noexcept { return rates.size(); }
};

/// What a Galerkin projection needs of a basis V of full-order states.
struct BasisProducts {
  Eigen::MatrixXd gram;    ///< V' V: near the identity
  Eigen::MatrixXd rates;   ///< V' (-A) V, 1/s
  Eigen::MatrixXd source;  ///< V' (beam (x) .), size x axial modes
  Eigen::VectorXd peak;    ///< C_peak V
  /// V c, radial x axial modes.
  std::function<Eigen::MatrixXd(const Eigen::VectorXd& c)> combine;
};

/// The space spanned by V. Throws Error if the columns of V are dependent. Allocates.
ImpulseSpace diagonalised(const BasisProducts& basis);

/// Separable models: snapshots e^(A t) B(alpha, beta) for all `absorption_factors` and t log-spaced
/// over [1e-6 s, 1 s]; directions with a Gram eigenvalue below 1e-13 of the largest are dropped as
/// rounding; memory and time grow with the number of axial modes, not with n. Others:
/// mor/resolvent_basis.hpp. Allocates.
ImpulseSpace impulse_space(const FullOrderModel& model,
                           const std::vector<AbsorptionFactors>& absorption_factors);

}  // namespace photocoag
