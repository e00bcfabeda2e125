// Role: simulation; the Plant concept, a simulated tissue. Used by loop, population, run.
#pragma once

#include <concepts>

#include "photocoag/core/outputs.hpp"

namespace photocoag {

/// One control period of constant power per step. Models: FullOrderPlant (fom), ReducedPlant (rom).
template <typename P>
concept Plant = requires(P plant, const P& constant, double power) {
  { plant.step(power) }
  noexcept;
  { constant.outputs() }
  noexcept->std::same_as<Outputs>;
};

/// Volume temperature of a period's sample, K: plant.sample() if there is one, else `at_the_end`.
template <Plant P>
double sample_of(const P& plant, double at_the_end) noexcept {
  if constexpr (requires { plant.sample(); }) {
    return plant.sample();
  } else {
    return at_the_end;
  }
}

}  // namespace photocoag
