// Role: offline; higher derivatives of the coefficient functions and bounds of them. Used by the
// certificate. Source: docs/models.md (certificate); V. A. Markov's inequality for Chebyshev
// polynomials. Units: 1. Threads: pure functions.
#pragma once

#include <Eigen/Core>

#include "photocoag/rom/theta.hpp"
#include "photocoag/tissue/absorption_derivatives.hpp"

namespace photocoag {

/// The derivatives of theta_j of this order at alpha and beta. Allocates.
Eigen::VectorXd theta_derivative(const Theta& theta, DerivativeOrder order, AbsorptionFactors at);

/// Upper bounds of their absolute values over `range`. Throws Error if `range` leaves the Chebyshev
/// polynomials' interval. Allocates.
Eigen::VectorXd theta_derivative_bound(const Theta& theta, DerivativeOrder order,
                                       const FactorRange& range);

}  // namespace photocoag
