// Role: simulation; one mode of the heat operator over one period of constant power. Used by fom.
// Source: docs/equations.md (E4). Units: SI. Real-time promise: bounded, noexcept.
#pragma once

#include <cmath>

#include "photocoag/core/discretization.hpp"
#include "photocoag/fom/rational_exponential.hpp"

namespace photocoag {

/// Beyond this exponent 1 - e^-x is 1 in a double: e^-40 < 2^-54.
inline constexpr double kSettledExponent = 40.0;

/// x' = -rate * x + u over one period: x becomes decay * x + gain * u.
struct ModeGain {
  double decay = 0.0;
  double gain = 0.0;  ///< s
};

inline ModeGain mode_gain(Discretization discretization, double rate, double period) noexcept {
  const double exponent = rate * period;
  if (discretization == Discretization::kImplicitEuler) {
    const double decay = 1.0 / (1.0 + exponent);
    return {decay, period * decay};
  }
  if (discretization == Discretization::kTrBdf2) {
    return {TrBdf2::decay(exponent), period * TrBdf2::gain(exponent)};
  }
  return {std::exp(-exponent), -std::expm1(-exponent) / rate};
}

}  // namespace photocoag
