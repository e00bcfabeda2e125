// Role: offline; higher derivatives of the coefficient functions and bounds of them. Used by the
// certificate. Source: docs/models.md (certificate); V. A. Markov's inequality for Chebyshev
// polynomials. Units: 1. Threads: pure functions.
#pragma once

#include <Eigen/Core>

#include "photocoag/rom/theta.hpp"

namespace photocoag {

/// n-th derivatives of theta_j at alpha, n >= 0. Allocates.
Eigen::VectorXd theta_derivative(const Theta& theta, int n, double alpha);

/// At least |theta_j^(n)| everywhere on [low, high]. Throws Error if Chebyshev polynomials are
/// asked about outside their interval. Allocates.
Eigen::VectorXd theta_derivative_bound(const Theta& theta, int n, double low, double high);

}  // namespace photocoag
