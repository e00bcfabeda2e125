// Role: simulated eye at full order; for many short treatments, one eye each. Used by run for
// campaigns. Source: docs/equations.md (E4) to (E6): the impulse response of ModalStepper's modes
// at the end of every period, then a convolution. Differences: a mode is dropped once it has
// decayed to 1e-15; rounding. Units: SI; rises over ambient, commanded power in W. Real-time
// promise: step and outputs are noexcept and allocate nothing.
#pragma once

#include <cstddef>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/core/outputs.hpp"
#include "photocoag/fom/full_order_model.hpp"

namespace photocoag {

/// Modes drop out over time, so that all samples together cost about ten steps of a ModalStepper. A
/// Plant (loop/plant.hpp).
class SampledPlant {
 public:
  /// For at most `steps` steps; past them the outputs are NaN. Throws Error if the model is not
  /// separable.
  SampledPlant(const FullOrderModel& model, Discretization discretization, double period,
               AbsorptionFactors absorption, std::size_t steps);

  void step(double power) noexcept;
  Outputs outputs() const noexcept { return outputs_; }

 private:
  std::vector<double> peak_;    // K/W, the last sample first
  std::vector<double> volume_;  // K/W
  std::vector<double> powers_;  // W, in the order of their steps
  std::size_t done_ = 0;
  Outputs outputs_;
};

}  // namespace photocoag
