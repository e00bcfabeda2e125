// Role: offline and online; how a continuous-time model is sampled. Used by fom, mor, rom,
// crosscheck, run, config.
#pragma once

#include <string_view>

namespace photocoag {

/// Time discretization of x' = A x + B u over one period h with constant power u.
enum class Discretization {
  kZeroOrderHold,  ///< exact: x+ = e^(Ah) x + A^-1 (e^(Ah) - I) B u
  kImplicitEuler,  ///< the paper's: x+ = (I - hA)^-1 (x + h B u); 12 % low after the first step
  kTrBdf2,         ///< trapezoidal rule, then BDF2: second order, L-stable
};

constexpr std::string_view to_string(Discretization value) noexcept {
  constexpr std::string_view names[] = {"zero-order-hold", "implicit-euler", "tr-bdf2"};
  return names[static_cast<std::size_t>(value)];
}

inline constexpr Discretization kDiscretizations[] = {
    Discretization::kZeroOrderHold, Discretization::kImplicitEuler, Discretization::kTrBdf2};

/// TR-BDF2 (Bank et al., IEEE Trans. CAD 4 (1985) 436-451; Hosea and Shampine, Appl. Numer. Math.
/// 20 (1996) 21-35) of x' = A x + b with constant b. Its two stages share one matrix:
///   M = (I - shift h A)^-1,  w = M (x + shift h b),  x+ = M (mix w + (1 - mix) x + shift h b).
/// w is the mean of x and the trapezoidal rule's value at gamma h, gamma = 2 - sqrt 2.
struct TrBdf2 {
  static constexpr double kGamma = 0.585786437626904951;  // 2 - sqrt 2
  static constexpr double kShift = 0.5 * kGamma;
  static constexpr double kMix = 2.0 / (kGamma * (2.0 - kGamma));
  static constexpr double kLeastDecay = -0.207106781186547525;  // (1 - sqrt 2) / 2

  /// Decay factor of a mode of rate l over one step h, exponent = l h; and its gain per unit input,
  /// divided by h.
  static constexpr double decay(double exponent) noexcept {
    const double stage = 1.0 / (1.0 + kShift * exponent);
    return (kMix * stage + 1.0 - kMix) * stage;
  }
  static constexpr double gain(double exponent) noexcept {
    const double stage = 1.0 / (1.0 + kShift * exponent);
    return kShift * (kMix * stage + 1.0) * stage;
  }
};

}  // namespace photocoag
