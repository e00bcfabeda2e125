// Role: offline; higher derivatives of absorbed fractions by alpha and beta, and bounds of them
// over ranges of both. Used by mor (Taylor series, certificate). Source: derived here from
// docs/equations.md (E3). Units: 1 (alpha and beta have none). Threads: pure functions.
#pragma once

#include <algorithm>
#include <cmath>

#include "photocoag/tissue/absorption.hpp"

namespace photocoag {

/// n times by alpha, m times by beta; not negative.
struct DerivativeOrder {
  int alpha = 0;
  int beta = 0;

  bool operator==(const DerivativeOrder&) const = default;
};

/// All alpha and beta from `low` to `high`, 0 <= low <= high.
struct FactorRange {
  AbsorptionFactors low;
  AbsorptionFactors high;
};

/// (q + d)^n - q^n for q, d >= 0 without cancellation: d sum_i (q + d)^i q^(n-1-i).
inline double power_step(double q, double d, int n) noexcept {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += std::pow(q + d, i) * std::pow(q, n - 1 - i);
  return d * sum;
}

/// With p, q the optical depths in front per alpha and beta, and P, Q those behind: front = p^n q^m
/// and step = P^n Q^m - p^n q^m, both non-negative.
struct DepthPowers {
  double front;
  double step;

  DepthPowers(const AbsorbedFraction& s, DerivativeOrder order) noexcept
      : front(std::pow(s.front[0], order.alpha) * std::pow(s.front[1], order.beta)),
        step(std::pow(s.back[0], order.alpha) *
                 power_step(s.front[1], s.back[1] - s.front[1], order.beta) +
             std::pow(s.front[1], order.beta) *
                 power_step(s.front[0], s.back[0] - s.front[0], order.alpha)) {}
};

/// The derivative of s of this order. With E = exp(-tau_front), X = exp(-(tau_back - tau_front)):
///   (-1)^(n+m) (p^n q^m E - P^n Q^m E X) = (-1)^(n+m) E [ p^n q^m (1 - X) - (P^n Q^m - p^n q^m) X
///   ].
inline double derivative(const AbsorbedFraction& fraction, DerivativeOrder order,
                         AbsorptionFactors at) noexcept {
  const AbsorbedFraction s = fraction.of_alpha(at);
  const double thickness = (s.fixed_back - s.fixed_front) + at.alpha * (s.back[0] - s.front[0]);
  const double front = std::exp(-(s.fixed_front + at.alpha * s.front[0]));
  const DepthPowers powers(fraction, order);
  const double bracket =
      -powers.front * std::expm1(-thickness) - powers.step * std::exp(-thickness);
  return ((order.alpha + order.beta) % 2 == 0 ? 1.0 : -1.0) * front * bracket;
}

/// Upper bound of |derivative| over `range`: the bracket is the difference of two non-negative
/// terms; E and X fall with alpha and beta, 1 - X grows.
inline double derivative_bound(const AbsorbedFraction& fraction, DerivativeOrder order,
                               const FactorRange& range) noexcept {
  const auto thickness = [&fraction](AbsorptionFactors at) {
    const AbsorbedFraction s = fraction.of_alpha(at);
    return (s.fixed_back - s.fixed_front) + at.alpha * (s.back[0] - s.front[0]);
  };
  const AbsorbedFraction s = fraction.of_alpha(range.low);
  const double front = std::exp(-(s.fixed_front + range.low.alpha * s.front[0]));
  const double absorbed = -std::expm1(-thickness(range.high));
  const double passed = std::exp(-thickness(range.low));
  const DepthPowers powers(fraction, order);
  return front * std::max(powers.front * absorbed, powers.step * passed);
}

}  // namespace photocoag
