// Role: offline; error of a time discretization of the full-order model. Used by `photocoag
// discretizations`. Source: docs/equations.md (E7) and deviation 14: the paper steps with implicit
// Euler. Units: SI.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/core/outputs.hpp"
#include "photocoag/fom/full_order_model.hpp"

namespace photocoag {

/// Step response to 1 W of one scheme at one period, beside the exact one.
struct DiscretizationErrors {
  Discretization discretization = Discretization::kImplicitEuler;
  double period = 0.0;           ///< s
  std::vector<Outputs> exact;    ///< after 1, 2, … periods
  std::vector<Outputs> stepped;  ///< the same with the scheme

  /// Relative error of the peak after `steps` periods, from 1; negative: too cold.
  double peak(std::size_t steps) const {
    return stepped.at(steps - 1).peak / exact.at(steps - 1).peak - 1.0;
  }
  double volume(std::size_t steps) const {
    return stepped.at(steps - 1).volume / exact.at(steps - 1).volume - 1.0;
  }
};

/// Implicit Euler and TR-BDF2 at each period, in this order, for `steps` periods of constant power.
/// Allocates.
std::vector<DiscretizationErrors> discretization_errors(
    const std::shared_ptr<const FullOrderModel>& full, AbsorptionFactors absorption,
    const std::vector<double>& periods, std::size_t steps);

}  // namespace photocoag
