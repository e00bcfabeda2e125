// Role: offline; one way to sample the step response of any model. Used by `response` and tests.
// Units: SI.
#pragma once

#include <cstddef>
#include <vector>

#include "photocoag/core/discretization.hpp"
#include "photocoag/core/outputs.hpp"

namespace photocoag {

/// Indices of `times` in ascending order; throws Error unless each is finite and from 0 to 10,000
/// s.
std::vector<std::size_t> ascending_times(const std::vector<double>& times);

/// Number of whole periods in `time`; throws Error if it is not a multiple (relative 1e-9).
std::size_t whole_periods(double time, double period);

/// Outputs at `times`, s (any order), after constant `power`, W, from t = 0 on; `system` starts
/// cold.
///
/// Zero-order hold: exact at any time, by one step from each time to the next. The others
/// advance in steps of `period`, s: a time that is not a multiple of it throws Error. System:
/// set_period(s), step(W), outputs() -> Outputs.
template <typename System>
std::vector<Outputs> sample_step_response(System& system, Discretization discretization,
                                          double period, double power,
                                          const std::vector<double>& times) {
  std::vector<Outputs> outputs(times.size());
  const std::vector<std::size_t> order = ascending_times(times);
  if (discretization != Discretization::kZeroOrderHold) {
    for (const double time : times) whole_periods(time, period);
    system.set_period(period);
    std::size_t done = 0;
    for (const std::size_t i : order) {
      for (const std::size_t end = whole_periods(times[i], period); done < end; ++done) {
        system.step(power);
      }
      outputs[i] = system.outputs();
    }
    return outputs;
  }
  double now = 0.0;
  for (const std::size_t i : order) {
    if (times[i] > now) {
      system.set_period(times[i] - now);
      system.step(power);
      now = times[i];
    }
    outputs[i] = system.outputs();
  }
  return outputs;
}

}  // namespace photocoag
