// Role: offline; from a reduced state back to temperatures in all cells: T = V x. Used by `field`.
// Source: docs/models.md (projection). V is not in the model file (n x order numbers): it is made
// again by the reduction, which is deterministic. Units: SI.
#pragma once

#include <Eigen/Core>

#include "photocoag/mor/reduce.hpp"

namespace photocoag {

/// A reduced model together with what lifts its states.
struct ReconstructingModel {
  ReducedModel model;  ///< as project_model() makes it
  ImpulseSpace space;
  Eigen::MatrixXd trial;  ///< impulse space x order, in the model's coordinates
};

/// Throws Error as project_model() does. Allocates.
ReconstructingModel reconstructing_model(const FullOrderModel& full,
                                         const ReductionSettings& settings, double period,
                                         Discretization discretization);

/// Temperature rise per cell of a reduced state, radial x axial, K. Allocates.
Eigen::MatrixXd reconstruct(const FullOrderModel& full, const ReconstructingModel& reduced,
                            const Eigen::VectorXd& state);

}  // namespace photocoag
