#include "photocoag/certify/taylor.hpp"

namespace photocoag {
namespace {

constexpr int kDegree = Taylor::kDegree;

bool is_zero(const Interval& a) noexcept { return a.low == 0.0 && a.high == 0.0; }
Interval symmetric(const Interval& a) noexcept { return {-a.magnitude(), a.magnitude()}; }

// sum_k factor_k y^k by Horner's rule.
template <typename Factor>
Taylor series(const Taylor& y, const Factor& factor) noexcept {
  Taylor sum(factor(kDegree));
  for (int k = kDegree - 1; k >= 0; --k) sum = sum * y + Taylor(factor(k));
  return sum;
}

Taylor without_constant(Taylor a) noexcept {
  a.coefficient[0] = Interval(0.0);
  return a;
}

}  // namespace

Interval Taylor::reach() const noexcept {
  Interval sum = rest;
  for (int k = 1; k < kTerms; ++k) {
    if (!is_zero(coefficient[k])) sum = sum + symmetric(coefficient[k]);
  }
  return sum;
}

Varying Taylor::varying() const noexcept {
  Varying v;
  v.at_middle = coefficient[0] + rest;
  for (int degree = 1; degree <= kDegree; ++degree) {
    for (int j = 0; j <= degree; ++j) {
      const Interval& c = coefficient[index(degree - j, j)];
      if (is_zero(c)) continue;
      // t_1^i t_2^j is t_1, or t_2, times something in [-1, 1]; in [0, 1] times t_1 for t_1^3, ….
      Interval& slope = v.slope[degree == j ? 1 : 0];
      slope = slope + (degree == 1 ? c : symmetric(c));
    }
  }
  return v;
}

Taylor operator+(const Taylor& a, const Taylor& b) noexcept {
  Taylor sum;
  for (int k = 0; k < Taylor::kTerms; ++k) {
    if (is_zero(a.coefficient[k])) {
      sum.coefficient[k] = b.coefficient[k];
    } else if (is_zero(b.coefficient[k])) {
      sum.coefficient[k] = a.coefficient[k];
    } else {
      sum.coefficient[k] = a.coefficient[k] + b.coefficient[k];
    }
  }
  sum.rest = a.rest + b.rest;
  return sum;
}

Taylor operator-(const Taylor& a, const Taylor& b) noexcept { return a + b * Interval(-1.0); }

Taylor operator*(const Taylor& a, const Interval& factor) noexcept {
  Taylor product;
  for (int k = 0; k < Taylor::kTerms; ++k) {
    if (!is_zero(a.coefficient[k])) product.coefficient[k] = a.coefficient[k] * factor;
  }
  product.rest = a.rest * factor;
  return product;
}

Taylor operator*(const Taylor& a, const Taylor& b) noexcept {
  Taylor product;
  product.rest =
      a.rest * (b.coefficient[0] + b.reach()) + b.rest * (a.coefficient[0] + symmetric(a.reach()));
  for (int p = 0; p <= kDegree; ++p) {
    for (int j = 0; j <= p; ++j) {
      const Interval& x = a.coefficient[Taylor::index(p - j, j)];
      if (is_zero(x)) continue;
      for (int q = 0; q <= kDegree; ++q) {
        for (int l = 0; l <= q; ++l) {
          const Interval& y = b.coefficient[Taylor::index(q - l, l)];
          if (is_zero(y)) continue;
          const Interval z = x * y;
          Interval& place = p + q <= kDegree
                                ? product.coefficient[Taylor::index(p - j + q - l, j + l)]
                                : product.rest;
          place = place + (p + q <= kDegree ? z : symmetric(z));
        }
      }
    }
  }
  return product;
}

// 1 / (c + y) = 1/c sum_k (-y/c)^k.
Taylor reciprocal(const Taylor& a) noexcept {
  const Interval inverse = reciprocal(a.coefficient[0]);
  const Taylor y = without_constant(a) * -inverse;
  const double most = y.reach().magnitude();
  Taylor sum = series(y, [](int) { return Interval(1.0); });
  double left = 1.0;
  for (int k = 0; k <= kDegree; ++k) left *= most * (1.0 + 1e-14);
  const double bound = most < 1.0 ? left / (1.0 - most) * (1.0 + 1e-14) : kUnbounded;
  sum.rest = sum.rest + Interval(-bound, bound);
  return sum * inverse;
}

// e^c sum_k y^k / k!.
Taylor exp(const Taylor& a) noexcept {
  const Taylor y = without_constant(a);
  const double most = y.reach().magnitude();
  double factorial[kDegree + 2] = {1.0};  // exact
  for (int k = 1; k <= kDegree + 1; ++k) factorial[k] = factorial[k - 1] * k;
  Taylor sum = series(y, [&](int k) { return reciprocal(Interval(factorial[k])); });
  double left = 1.0 / factorial[kDegree + 1];
  for (int k = 0; k <= kDegree; ++k) left *= most * (1.0 + 1e-14);
  const double bound = left * exp(Interval(most)).high * (1.0 + 1e-14);
  sum.rest = sum.rest + Interval(-bound, bound);
  return sum * exp(a.coefficient[0]);
}

}  // namespace photocoag
