// Role: offline; Taylor models: polynomials over a cell of absorption factors with a bound of the
// remainder. Used by certify/cell_problem, where slopes alone would not see cancellation.
// Source: R. E. Moore, R. B. Kearfott, M. J. Cloud (2009), ch. 9 (Taylor models).
// Units: none. Real time: none. Threads: plain data.
#pragma once

#include <array>

#include "photocoag/certify/interval.hpp"

namespace photocoag {

/// p(t) + rest for t in [-1, 1]^2, p of degree kDegree in t_1 and t_2 together.
struct Taylor {
  static constexpr int kDegree = 6;
  static constexpr int kTerms = (kDegree + 1) * (kDegree + 2) / 2;

  std::array<Interval, kTerms> coefficient{};
  Interval rest;

  Taylor() = default;
  explicit Taylor(const Interval& constant) noexcept { coefficient[0] = constant; }

  /// Index of the coefficient of t_1^i t_2^j, ordered by i + j.
  static constexpr int index(int i, int j) noexcept { return (i + j) * (i + j + 1) / 2 + j; }

  /// Range without the constant term.
  Interval reach() const noexcept;
  /// The same function with the higher-order terms in the slopes and the remainder in the middle
  /// value.
  Varying varying() const noexcept;
};

Taylor operator+(const Taylor& a, const Taylor& b) noexcept;
Taylor operator-(const Taylor& a, const Taylor& b) noexcept;
Taylor operator*(const Taylor& a, const Taylor& b) noexcept;
Taylor operator*(const Taylor& a, const Interval& factor) noexcept;
/// The whole real line unless 0 is excluded.
Taylor reciprocal(const Taylor& a) noexcept;
Taylor exp(const Taylor& a) noexcept;

}  // namespace photocoag
