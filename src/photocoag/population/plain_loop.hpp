// Role: studies; Algorithm 1 on one eye for who looks at every cycle: no device, no supervisor, no
// record. Used by estimation_study, unknowns_study, information. Units: SI.
#pragma once

#include <cstddef>

#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/plant.hpp"

namespace photocoag {

/// `power_of(decided, k)`: what the eye gets, W, of what the controller decided and believes.
/// `sample_of(truth, k)`: K; NaN: none. `look(truth, estimate, k)`: at the end of cycle k. `dark`:
/// 0 W throughout instead of the controller's power.
template <Plant P>
void treat_plainly(Controller& controller, P& eye, std::size_t cycles, bool dark,
                   const auto& power_of, const auto& sample_of, const auto& look) {
  for (std::size_t k = 0; k < cycles; ++k) {
    const double power = dark ? 0.0 : controller.decide().power;
    eye.step(power_of(power, k));
    const Outputs truth = eye.outputs();
    const Estimate estimate = controller.observe(
        {.volume_temperature = sample_of(truth.volume, k), .applied_power = power});
    look(truth, estimate, k);
  }
}

/// The same with all of the power.
template <Plant P>
void treat_plainly(Controller& controller, P& eye, std::size_t cycles, bool dark,
                   const auto& sample_of, const auto& look) {
  treat_plainly(
      controller, eye, cycles, dark, [](double power, std::size_t) { return power; }, sample_of,
      look);
}

}  // namespace photocoag
