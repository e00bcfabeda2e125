// Role: offline and online; the Lambert-Beer law of the layered tissue and its derivatives.
// Used by fom (source and volume output) and rom (DEIM points). Source: paper, section 2;
// docs/equations.md (E2), (E3), (E5). Difference: the volume output's weight has the minus sign.
// Units: SI. Real time: evaluate functions are noexcept and do not allocate.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// Factors on the reference absorption, one per parameter, in the order of ScaledBy. A single
/// number is alpha.
struct AbsorptionFactors {
  double alpha;
  double beta;

  // Implicit: most tissues have alpha only.
  constexpr AbsorptionFactors(double a, double b = 1.0) noexcept : alpha(a), beta(b) {}
  /// Parameter q: 0 is alpha, 1 is beta.
  constexpr double operator[](std::size_t q) const noexcept { return q == 0 ? alpha : beta; }
  bool operator==(const AbsorptionFactors&) const = default;
};

/// One number per parameter, in the order of ScaledBy.
using PerParameter = std::array<double, kMaxParameters>;

/// A value that depends on the parameters, with its derivatives.
struct ValueAndSlope {
  double value = 0.0;
  PerParameter slope{};  ///< d value / d parameter; by alpha alone from evaluate(double)
};

/// Fraction of the incident power that is absorbed between two depths a < b, as a function of the
/// parameters p_q:
///   s = exp(-tau(a)) - exp(-tau(b)),   tau(z) = fixed(z) + sum_q p_q scaled_q(z).
struct AbsorbedFraction {
  double fixed_front = 0.0;  ///< 1, optical depth at a from layers that do not scale
  double fixed_back = 0.0;   ///< 1, at b
  PerParameter front{};      ///< 1, optical depth at a per parameter
  PerParameter back{};       ///< 1, at b

  /// The same as a function of alpha alone, the other parameters fixed at `at`.
  AbsorbedFraction of_alpha(AbsorptionFactors at) const noexcept {
    AbsorbedFraction result{fixed_front, fixed_back, {front[0]}, {back[0]}};
    for (std::size_t q = kMaxParameters - 1; q > 0; --q) {
      result.fixed_front += at[q] * front[q];
      result.fixed_back += at[q] * back[q];
    }
    return result;
  }

  /// With all derivatives.
  ValueAndSlope evaluate(AbsorptionFactors at) const noexcept {
    const AbsorbedFraction one = of_alpha(at);
    ValueAndSlope result = one.evaluate_alpha(at.alpha);
    const double passed = std::exp(-(one.fixed_front + at.alpha * front[0]));
    const double step = result.value / passed;
    for (std::size_t q = 1; q < kMaxParameters; ++q) {
      result.slope[q] = passed * ((back[q] - front[q]) - back[q] * step);
    }
    return result;
  }

  /// At alpha, all other parameters 1, with the derivative by alpha.
  ValueAndSlope evaluate(double alpha) const noexcept {
    return of_alpha(alpha).evaluate_alpha(alpha);
  }

  /// For a fraction that depends on alpha alone (of_alpha).
  ValueAndSlope evaluate_alpha(double alpha) const noexcept {
    const double passed = std::exp(-(fixed_front + alpha * front[0]));
    // 1 - exp(-(tau_b - tau_a)) without cancellation in thin cells.
    const double step = -std::expm1(-((fixed_back - fixed_front) + alpha * (back[0] - front[0])));
    // d/dalpha [e^-a - e^-b] = b' e^-b - a' e^-a, with e^-b = passed * (1 - step): the same care.
    return {passed * step, {passed * ((back[0] - front[0]) - back[0] * step)}};
  }

  bool operator==(const AbsorbedFraction&) const = default;
};

/// tau(z; p) = int_0^z mu: piecewise linear in z, affine in the parameters.
class AbsorptionLaw {
 public:
  /// Throws Error if the tissue is not valid.
  explicit AbsorptionLaw(const Tissue& tissue);

  /// The absorbed fraction between depths `front` <= `back`, m, both inside the tissue.
  AbsorbedFraction between(double front, double back) const;
  /// The absorbed fraction of the whole tissue.
  AbsorbedFraction whole() const { return between(0.0, depths_.back()); }

 private:
  std::vector<double> depths_;  // m, layer boundaries
  std::vector<double> fixed_;   // optical depth at the boundaries
  std::array<std::vector<double>, kMaxParameters> scaled_;
};

}  // namespace photocoag
