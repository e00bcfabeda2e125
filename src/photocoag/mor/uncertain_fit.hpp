// Role: offline; fits the full-order model's responses over several uncertain quantities by shared
// modes with polynomial residues. Used by the model cache and `reduce`. Source:
// docs/uncertainty.md: vector fitting with fixed poles (Gustavsen and Semlyen, 1999) and least
// squares over a sparse polynomial basis. Units: SI. Real time: no.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "photocoag/core/types.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/fom/grid_settings.hpp"
#include "photocoag/mor/settings.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag {

/// Fits to eyes spread over the box of `belief`'s quantities and measures the error on others.
/// Throws Error if the tissue's layers conduct differently or are perfused, or a quantity does not
/// fit the tissue.
UncertainModel fit_uncertain_model(const Tissue& tissue, const GridSettings& grid,
                                   const Belief& belief, double period);

/// Step response for 1 W of one eye at the times, s, ascending: peak, volume. `eye`: a separable
/// full-order model, as the continuous-time impulse response is then a product of sums over radial
/// and axial modes.
struct StepResponse {
  Eigen::VectorXd peak;
  Eigen::VectorXd volume;
};
StepResponse step_response_of(const FullOrderModel& eye, double absorption_factor,
                              const std::vector<double>& times);

}  // namespace photocoag
