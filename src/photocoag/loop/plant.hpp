// Role: simulation; what a simulated tissue must offer. Used by loop.
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

/// What a sample shows of a period: `at_the_end`, or what the plant itself says.
template <Plant P>
double sample_of(const P& plant, double at_the_end) noexcept {
  if constexpr (requires { plant.sample(); }) {
    return plant.sample();
  } else {
    return at_the_end;
  }
}

}  // namespace photocoag
