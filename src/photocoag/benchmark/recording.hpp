// Role: benchmark and tests; records the problems of a closed loop for replay by any solver. Used
// by `bench qp`, tests. Units: SI. Real-time promise: none.
#pragma once

#include <vector>

#include "photocoag/loop/simulated_eye.hpp"

namespace photocoag {

/// Input of the controller's decision in one cycle.
struct RecordedCycle {
  StateVector state;            ///< estimate x
  StateVector input;            ///< B_d(alpha) at the estimate
  double previous_power = 0.0;  ///< W
  Sample sample;                ///< processed before the decision; cycle 0: none
};

struct RecordedLoop {
  double absorption_factor = 0.0;
  std::vector<RecordedCycle> cycles;  ///< cycle n = 0, 1, …
};

/// Runs the default controller on the simulated eye for `cycles` cycles.
template <Plant P>
RecordedLoop record_loop(const ReducedModel& model, const ControlSettings& control,
                         const EstimatorSettings& estimator, SimulatedEye<P>& eye,
                         double absorption_factor, int cycles) {
  Controller controller(model, control, estimator);
  RecordedLoop loop{.absorption_factor = absorption_factor, .cycles = {}};
  Sample sample;
  double previous = 0.0;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    if (cycle > 0) controller.observe(sample);
    loop.cycles.push_back({.state = controller.filter().state(),
                           .input = controller.filter().matrices().input,
                           .previous_power = previous,
                           .sample = sample});
    const Decision decision = controller.decide();
    eye.write(decision.power);
    sample = eye.advance(static_cast<std::uint64_t>(cycle)).sample;
    previous = sample.applied_power;
  }
  return loop;
}

}  // namespace photocoag
