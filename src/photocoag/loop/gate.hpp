// Role: online; the last pure function before the laser. Used by the controller.
// Source: docs/equations.md (E23). Real time: noexcept, no state.
#pragma once

namespace photocoag {

enum class GateVerdict {
  kPassed,
  kNotFinite,  ///< NaN or infinite
  kOutside,    ///< below 0 or above the limit by more than rounding
};

struct GateResult {
  double power = 0.0;  ///< W, to be written: the command, or 0
  GateVerdict verdict = GateVerdict::kNotFinite;
};

/// The command if it is finite and in [0, power_max], else 0 W. A command above power_max by at
/// most rounding (1e-12 relative) becomes power_max. Independent of estimator and optimisation.
constexpr GateResult gate(double power, double power_max) noexcept {
  const double excess = power - power_max;
  if (!(power - power == 0.0)) return {0.0, GateVerdict::kNotFinite};
  if (power < 0.0 || excess > 1e-12 * power_max) return {0.0, GateVerdict::kOutside};
  return {excess > 0.0 ? power_max : power, GateVerdict::kPassed};
}

}  // namespace photocoag
