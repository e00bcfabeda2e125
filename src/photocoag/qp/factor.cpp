#include "photocoag/qp/factor.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/qp/sums.hpp"

namespace photocoag {
namespace {

constexpr double kPivot = 1e-14;  // a pivot over the diagonal: below, H is not definite
constexpr int kBlock = 4;         // columns that are eliminated together

// y - (the sum of column_i x_i, i < k) inverse: the last product last, which is known last.
inline double eliminated(double y, const double* __restrict column, const double* __restrict x,
                         int k, double inverse) noexcept {
  if (k == 0) return y;
  double sum;
  if (k < 9) {
    double even = 0.0;
    double odd = 0.0;
    int i = 0;
    for (; i + 2 < k; i += 2) {
      even += column[i] * x[i];
      odd += column[i + 1] * x[i + 1];
    }
    if (i + 1 < k) even += column[i] * x[i];
    sum = even + odd;
  } else {
    sum = dot(column, x, k - 1);
  }
  return y - (sum + column[k - 1] * x[k - 1]) * inverse;
}

}  // namespace

template <typename Length>
bool HessianFactor::minimize_as(Length length, const double* __restrict hessian,
                                const double* __restrict gradient, double* __restrict u) noexcept {
  const int n = length;
  double* __restrict c = columns_;
  double* __restrict inverse = inverse_;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i) c[j * n + i] = hessian[j * n + i];
    u[j] = -gradient[j];
  }
  for (int end = n; end > 0; end -= kBlock) {
    const int begin = std::max(end - kBlock, 0);
    for (int k = end - 1; k >= begin; --k) {
      double* column = c + k * n;
      if (!(column[k] > kPivot * hessian[k * n + k])) return false;
      inverse[k] = 1.0 / column[k];
      for (int j = begin; j < k; ++j) {
        const double s = column[j] * inverse[k];
        for (int i = 0; i <= j; ++i) c[j * n + i] -= s * column[i];
      }
      // Substitution goes along: y = D U~^-1 (-g) with the unit triangle U~ = C D^-1.
      const double s = u[k] * inverse[k];
      for (int i = 0; i < k; ++i) u[i] -= s * column[i];
    }
    if (begin == 0) break;
    // The block's four columns from all that follow, in one pass over each.
    const double* p0 = c + begin * n;
    const double* p1 = p0 + n;
    const double* p2 = p1 + n;
    const double* p3 = p2 + n;
    for (int j = 0; j < begin; ++j) {
      const double s0 = p0[j] * inverse[begin];
      const double s1 = p1[j] * inverse[begin + 1];
      const double s2 = p2[j] * inverse[begin + 2];
      const double s3 = p3[j] * inverse[begin + 3];
      double* target = c + j * n;
      for (int i = 0; i <= j; ++i) {
        target[i] -= (s0 * p0[i] + s1 * p1[i]) + (s2 * p2[i] + s3 * p3[i]);
      }
    }
  }
  for (int k = 0; k < n; ++k) {
    const double* column = c + k * n;
    u[k] = eliminated(u[k] * inverse[k], column, u, k, inverse[k]);
  }
  return true;
}

bool HessianFactor::minimize(const InputMatrix& hessian, const InputVector& gradient,
                             double* u) noexcept {
  n_ = static_cast<int>(hessian.rows());
  return for_length<1, 2, 3, 4, 9>(
      n_, [&](auto length) { return minimize_as(length, hessian.data(), gradient.data(), u); });
}

void HessianFactor::take_roots() noexcept {
  for (int k = 0; k < n_; ++k) root_[k] = std::sqrt(inverse_[k]);
}

void HessianFactor::solve(double* x, int count) const noexcept {
  for_length<2, 3, 4, 9>(n_, [&](auto length) {
    // A known length is gone through: of the zeros at the end nothing but zeros is taken.
    constexpr bool kKnown = !std::is_same_v<decltype(length), int>;
    const double* __restrict c = columns_;
    double* __restrict y = x;
    const int n = length;
    const int last = kKnown ? n : count;
    for (int k = last - 1; k >= 0; --k) {
      const double s = y[k] * inverse_[k];
      for (int i = 0; i < k; ++i) y[i] -= s * c[k * n + i];
      y[k] *= root_[k];
    }
  });
}

void HessianFactor::solve_transposed(double* x) const noexcept {
  for_length<2, 3, 4, 9>(n_, [&](auto length) {
    const int n = length;
    for (int k = 0; k < n; ++k) {
      x[k] = eliminated(x[k] * root_[k], columns_ + k * n, x, k, inverse_[k]);
    }
  });
}

}  // namespace photocoag
