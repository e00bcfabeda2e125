// Role: offline; bases of the reduced state space, one function per method. Used by mor.
// Source: docs/models.md (bases). All work in the impulse space (impulse_space.hpp): A = -diag
// (rates), B(alpha) = gain * F source(alpha), C_vol = B' / gain, C_peak. Units: SI.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/impulse_space.hpp"
#include "photocoag/mor/parameter_dependence.hpp"
#include "photocoag/mor/settings.hpp"

namespace photocoag {

/// x = trial * reduced state; residual orthogonal to `test`; test' trial = I.
struct Bases {
  Eigen::MatrixXd trial;  ///< impulse-space size x order
  Eigen::MatrixXd test;   ///< the same columns as trial, or others (Petrov-Galerkin)
  bool galerkin = true;   ///< test = trial, orthonormal: keeps symmetry and stability
};

/// `betas`: with two parameters every sampled alpha is combined with each of them. `source`: used
/// by the Taylor basis only (its coefficients are the inputs). Throws Error if the impulse space
/// has fewer than `order` directions. Allocates.
Bases make_bases(const FullOrderModel& full, const ImpulseSpace& space, ReductionMethod method,
                 int order, const ParametricSource& source,
                 const std::vector<double>& betas = {1.0});

/// Dominant controllability modes: leading eigenvectors of the mean over alpha of the
/// controllability Gramians, each scaled by its peak steady gain.
Eigen::MatrixXd controllability_basis(const FullOrderModel& full, const ImpulseSpace& space,
                                      int order, const std::vector<double>& betas = {1.0});
/// Balanced truncation of the model with all sampled inputs and outputs stacked.
Bases balanced_bases(const FullOrderModel& full, const ImpulseSpace& space, int order,
                     const std::vector<double>& betas = {1.0});
/// Rational Krylov spaces of IRKA at sampled alphas, compressed to the order.
Eigen::MatrixXd irka_basis(const FullOrderModel& full, const ImpulseSpace& space, int order,
                           const std::vector<double>& betas = {1.0});
/// Impulse responses of the Taylor coefficients, each weighted by its largest share on [0.3, 1.7].
Eigen::MatrixXd taylor_basis(const ImpulseSpace& space, const ParametricSource& source, int order);

}  // namespace photocoag
