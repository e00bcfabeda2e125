// Role: offline; projection of the impulse-space model and the coordinates of the result. Used by
// mor. Source: docs/models.md (bases). Units: SI.
#pragma once

#include "photocoag/mor/bases.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// Fills A, B, C_volume, C_peak and theta of `model`. Galerkin: A is diagonal, C_peak not negative.
/// Petrov-Galerkin: the same where A's eigenvalues are real and its eigenvectors well conditioned,
/// else A as projected. Returns the trial basis in the model's coordinates: impulse-space state =
/// trial * reduced state. Throws Error if A is not stable. Allocates.
Eigen::MatrixXd project(const FullOrderModel& full, const ImpulseSpace& space, const Bases& bases,
                        const ParametricSource& source, ReducedModel& model);

}  // namespace photocoag
