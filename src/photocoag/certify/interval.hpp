// Role: offline; interval arithmetic, and functions over a small box of absorption factors. Used by
// certify. Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, "Introduction to Interval Analysis"
// (2009), ch. 2 to 6 (slopes: 6.5).
// Differences: bounds are moved outwards by an ulp after every operation, whatever the rounding
// mode; exp is assumed accurate to 4 ulp. Units: none. Real time: none. Threads: plain data.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace photocoag {

inline constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// All numbers from `low` to `high`. An operation's result contains the results for all numbers in
/// its operands.
struct Interval {
  double low = 0.0;
  double high = 0.0;

  constexpr Interval() = default;
  constexpr Interval(double value) noexcept : low(value), high(value) {}  // implicit: an exact one
  constexpr Interval(double l, double h) noexcept : low(l), high(h) {}

  double middle() const noexcept { return 0.5 * (low + high); }
  /// Upper bound of the distance from middle().
  double radius() const noexcept {
    const double m = middle();
    return std::max(high - m, m - low) * (1.0 + 1e-15) + std::numeric_limits<double>::min();
  }
  double magnitude() const noexcept { return std::max(std::abs(low), std::abs(high)); }
};

/// Widens by the possible rounding error.
inline Interval outward(double low, double high) noexcept {
  constexpr double kUlp = std::numeric_limits<double>::epsilon();
  constexpr double kLeast = std::numeric_limits<double>::min();
  return {low - std::abs(low) * kUlp - kLeast, high + std::abs(high) * kUlp + kLeast};
}

inline Interval operator-(const Interval& a) noexcept { return {-a.high, -a.low}; }
inline Interval operator+(const Interval& a, const Interval& b) noexcept {
  return outward(a.low + b.low, a.high + b.high);
}
inline Interval operator-(const Interval& a, const Interval& b) noexcept { return a + -b; }
inline Interval operator*(const Interval& a, const Interval& b) noexcept {
  if (!(a.magnitude() * b.magnitude() < kUnbounded)) return {-kUnbounded, kUnbounded};
  const double p = a.low * b.low;
  const double q = a.low * b.high;
  const double r = a.high * b.low;
  const double s = a.high * b.high;
  return outward(std::min(std::min(p, q), std::min(r, s)),
                 std::max(std::max(p, q), std::max(r, s)));
}
/// The whole real line if `a` contains 0.
inline Interval reciprocal(const Interval& a) noexcept {
  if (!(a.low > 0.0) && !(a.high < 0.0)) return {-kUnbounded, kUnbounded};
  return outward(1.0 / a.high, 1.0 / a.low);
}
inline Interval hull(const Interval& a, const Interval& b) noexcept {
  return {std::min(a.low, b.low), std::max(a.high, b.high)};
}
inline Interval exp(const Interval& a) noexcept {
  constexpr double kTrusted = 4.0 * std::numeric_limits<double>::epsilon();
  return outward(std::exp(a.low) * (1.0 - kTrusted), std::exp(a.high) * (1.0 + kTrusted));
}

/// A function x(t) of t in [-1, 1]^2, the position in a box of (alpha, beta), as
///   x(t) in at_middle + slope_1 t_1 + slope_2 t_2:
/// its range overestimates by O(width^2) of the box, plain intervals by O(width).
struct Varying {
  static constexpr int kPlaces = 2;

  Interval at_middle;
  std::array<Interval, kPlaces> slope{};

  Varying() = default;
  Varying(double value) noexcept : at_middle(value) {}  // implicit: a constant
  explicit Varying(const Interval& constant) noexcept : at_middle(constant) {}
  Varying(const Interval& middle, const Interval& s1, const Interval& s2) noexcept
      : at_middle(middle), slope{s1, s2} {}

  Interval range() const noexcept {
    const double reach = slope[0].magnitude() + slope[1].magnitude();
    return at_middle + outward(-reach, reach);
  }
};

inline Varying operator-(const Varying& a) noexcept {
  return {-a.at_middle, -a.slope[0], -a.slope[1]};
}
inline Varying operator+(const Varying& a, const Varying& b) noexcept {
  return {a.at_middle + b.at_middle, a.slope[0] + b.slope[0], a.slope[1] + b.slope[1]};
}
inline Varying operator-(const Varying& a, const Varying& b) noexcept { return a + -b; }
inline Varying operator*(const Varying& a, const Varying& b) noexcept {
  const Interval reach = b.range();
  return {a.at_middle * b.at_middle, a.at_middle * b.slope[0] + a.slope[0] * reach,
          a.at_middle * b.slope[1] + a.slope[1] * reach};
}
inline Varying reciprocal(const Varying& a) noexcept {
  // 1/x(t) - 1/x(0) = -(x(t) - x(0)) / (x(t) x(0)).
  const Interval factor = -reciprocal(a.range() * a.at_middle);
  return {reciprocal(a.at_middle), a.slope[0] * factor, a.slope[1] * factor};
}
inline Varying exp(const Varying& a) noexcept {
  const Interval factor = exp(a.range());
  return {exp(a.at_middle), a.slope[0] * factor, a.slope[1] * factor};
}

}  // namespace photocoag
