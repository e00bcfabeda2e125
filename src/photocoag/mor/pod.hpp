// Role: offline; global POD basis over alpha. Used by mor. Source: paper, section 2 (global basis
// approach; Benner, Gugercin and Willcox, SIAM Review 57 (2015), section 4.1); docs/equations.md
// (E13).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/mor/impulse_space.hpp"

namespace photocoag {

/// Orthonormal basis, impulse-space size x order: the leading left singular vectors of the weighted
/// impulse responses of the training alphas, with two parameters at each of `betas`. Throws Error
/// if the impulse space has fewer than `order` directions.
Eigen::MatrixXd pod_basis(const FullOrderModel& model, const ImpulseSpace& space, int order,
                          const std::vector<double>& betas = {1.0});

/// Snapshots of one input's impulse response with the method's weights of time, impulse-space size
/// x times; Frobenius norm `weight`. `input`: coordinates in the impulse space.
Eigen::MatrixXd weighted_impulse_response(const ImpulseSpace& space, const Eigen::VectorXd& input,
                                          double weight);

/// `order` leading left singular vectors. Throws Error if there are not so many.
Eigen::MatrixXd leading_directions(const Eigen::MatrixXd& snapshots, int order);

}  // namespace photocoag
