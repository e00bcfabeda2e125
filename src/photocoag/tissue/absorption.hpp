// Role: offline and online; the Lambert-Beer law of the layered tissue and its alpha-derivative.
// Used by fom (source and volume output) and rom (DEIM points). Source: paper, section 2;
// docs/equations.md (E2), (E3), (E5). Difference: the volume output's weight has the minus sign.
// Units: SI. Real time: evaluate functions are noexcept and do not allocate.
#pragma once

#include <cmath>
#include <vector>

#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// How much of its reference absorption the tissue has: alpha for the layers with scaled_by =
/// "alpha" (RPE), beta for those with scaled_by = "beta" (choroid). A number alone is alpha.
struct AbsorptionFactors {
  double alpha;
  double beta;

  // Implicit: most tissues have alpha only.
  constexpr AbsorptionFactors(double a, double b = 1.0) noexcept : alpha(a), beta(b) {}
  bool operator==(const AbsorptionFactors&) const = default;
};

/// A value that depends on alpha and beta, with its derivatives.
struct ValueAndSlope {
  double value = 0.0;
  double slope = 0.0;          ///< d value / d alpha
  double slope_choroid = 0.0;  ///< d value / d beta; not filled by evaluate(alpha)
};

/// Fraction of the incident power that is absorbed between two depths a < b, as a function of
/// alpha and of beta, which scales the layers with scaled_by_beta and is 1 where nobody asks:
///   s = exp(-tau(a)) - exp(-tau(b)),   tau(z) = fixed(z) + beta * choroid(z) + alpha * scaled(z).
struct AbsorbedFraction {
  double fixed_front = 0.0;    ///< 1, optical depth at a from layers that do not scale
  double scaled_front = 0.0;   ///< 1, optical depth at a per alpha
  double fixed_back = 0.0;     ///< 1, at b
  double scaled_back = 0.0;    ///< 1, at b
  double choroid_front = 0.0;  ///< 1, optical depth at a per beta
  double choroid_back = 0.0;   ///< 1, at b

  /// The same with beta's part counted as fixed.
  AbsorbedFraction at_choroid(double beta) const noexcept {
    return {fixed_front + beta * choroid_front, scaled_front, fixed_back + beta * choroid_back,
            scaled_back};
  }

  /// With both derivatives.
  ValueAndSlope evaluate(double alpha, double beta) const noexcept {
    ValueAndSlope result = at_choroid(beta).evaluate_fixed(alpha);
    const double front = std::exp(-(fixed_front + beta * choroid_front + alpha * scaled_front));
    const double step = result.value / front;
    result.slope_choroid = front * ((choroid_back - choroid_front) - choroid_back * step);
    return result;
  }

  /// At beta = 1.
  ValueAndSlope evaluate(double alpha) const noexcept {
    return at_choroid(1.0).evaluate_fixed(alpha);
  }

  /// Of what does not depend on beta.
  ValueAndSlope evaluate_fixed(double alpha) const noexcept {
    const double front = std::exp(-(fixed_front + alpha * scaled_front));
    // 1 - exp(-(tau_b - tau_a)) without cancellation in thin cells.
    const double step =
        -std::expm1(-((fixed_back - fixed_front) + alpha * (scaled_back - scaled_front)));
    // d/dalpha [e^-a - e^-b] = b' e^-b - a' e^-a, with e^-b = front * (1 - step): the same care.
    return {front * step, front * ((scaled_back - scaled_front) - scaled_back * step)};
  }

  bool operator==(const AbsorbedFraction&) const = default;
};

/// tau(z; alpha, beta) = int_0^z mu: piecewise linear in z, affine in alpha and beta.
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
  std::vector<double> scaled_;
  std::vector<double> choroid_;
};

}  // namespace photocoag
