// Role: offline; higher alpha-derivatives of absorbed fractions and bounds of them over a range of
// alpha, at beta = 1. Used by mor (Taylor series, certificate). Source: derived here from docs/equations.md
// (E3). Units: 1 (alpha has none). Threads: pure functions.
#pragma once

#include <algorithm>
#include <cmath>

#include "photocoag/tissue/absorption.hpp"

namespace photocoag {

/// (q + d)^n - q^n for q, d >= 0 without cancellation: d sum_i (q + d)^i q^(n-1-i).
inline double power_step(double q, double d, int n) noexcept {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += std::pow(q + d, i) * std::pow(q, n - 1 - i);
  return d * sum;
}

/// n-th derivative of s(alpha), n >= 0. With p, q the optical depths per alpha in front and behind,
/// E = exp(-tau_front) and X = exp(-(tau_back - tau_front)):
///   s^(n) = (-1)^n (p^n E - q^n E X) = (-1)^n E [ p^n (1 - X) - (q^n - p^n) X ].
inline double derivative(const AbsorbedFraction& fraction, int n, double alpha) noexcept {
  const AbsorbedFraction s = fraction.at_choroid(1.0);
  const double p = s.scaled_front;
  const double step = s.scaled_back - s.scaled_front;
  const double thickness = (s.fixed_back - s.fixed_front) + alpha * step;
  const double front = std::exp(-(s.fixed_front + alpha * p));
  const double bracket =
      -std::pow(p, n) * std::expm1(-thickness) - power_step(p, step, n) * std::exp(-thickness);
  return (n % 2 == 0 ? 1.0 : -1.0) * front * bracket;
}

/// At least |s^(n)| everywhere on [low, high], 0 <= low <= high: the bracket is the difference of
/// two terms that are not negative, E and X fall with alpha and 1 - X grows.
inline double derivative_bound(const AbsorbedFraction& fraction, int n, double low,
                               double high) noexcept {
  const AbsorbedFraction s = fraction.at_choroid(1.0);
  const double p = s.scaled_front;
  const double step = s.scaled_back - s.scaled_front;
  const double fixed = s.fixed_back - s.fixed_front;
  const double front = std::exp(-(s.fixed_front + low * p));
  const double absorbed = -std::expm1(-(fixed + high * step));
  const double passed = std::exp(-(fixed + low * step));
  return front * std::max(std::pow(p, n) * absorbed, power_step(p, step, n) * passed);
}

}  // namespace photocoag
