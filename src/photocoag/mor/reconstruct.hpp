// Role: offline; from a reduced state back to temperatures in all cells: T = V x. Used by `field`.
// Source: docs/models.md (bases). V (n x order) is not in the model file: the reduction, which is
// deterministic, is repeated to get it. Units: SI.
#pragma once

#include <Eigen/Core>

#include "photocoag/mor/reduce.hpp"

namespace photocoag {

/// A reduced model with the basis that lifts its states.
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
