#include "photocoag/qp/factor.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/fixed_length.hpp"

namespace photocoag {
namespace {

constexpr double kPivot = 1e-14;  // a pivot over the diagonal: below, H is not definite
constexpr int kBlock = 4;         // columns that are eliminated together

}  // namespace

template <typename Length>
bool HessianFactor::minimize_as(Length length, const double* __restrict hessian,
                                const double* __restrict gradient, double* __restrict u) noexcept {
  const int n = length;
  double* __restrict c = columns_;
  double* __restrict inverse = inverse_;
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) c[j * n + i] = hessian[j * n + i];
    u[j] = -gradient[j];
  }
  for (int first = 0; first < n; first += kBlock) {
    const int last = std::min(first + kBlock, n);
    for (int k = first; k < last; ++k) {
      double* column = c + k * n;
      if (!(column[k] > kPivot * hessian[k * n + k])) return false;
      inverse[k] = 1.0 / column[k];
      for (int j = k + 1; j < last; ++j) {
        const double s = column[j] * inverse[k];
        for (int i = j; i < n; ++i) c[j * n + i] -= s * column[i];
      }
      // Forward substitution goes along: y = D L~^-1 (-g) with the unit triangle L~ = C D^-1.
      const double s = u[k] * inverse[k];
      for (int i = k + 1; i < n; ++i) u[i] -= s * column[i];
    }
    // The block's four columns from all that follow, in one pass over each.
    const double* p0 = c + first * n;
    const double* p1 = p0 + n;
    const double* p2 = p1 + n;
    const double* p3 = p2 + n;
    for (int j = first + kBlock; j < n; ++j) {
      const double s0 = p0[j] * inverse[first];
      const double s1 = p1[j] * inverse[first + 1];
      const double s2 = p2[j] * inverse[first + 2];
      const double s3 = p3[j] * inverse[first + 3];
      double* target = c + j * n;
      for (int i = j; i < n; ++i) {
        target[i] -= (s0 * p0[i] + s1 * p1[i]) + (s2 * p2[i] + s3 * p3[i]);
      }
    }
  }
  for (int k = n - 1; k >= 0; --k) {
    const double* column = c + k * n;
    double even = 0.0;
    double odd = 0.0;
    int i = k + 1;
    for (; i + 1 < n; i += 2) {
      even += column[i] * u[i];
      odd += column[i + 1] * u[i + 1];
    }
    if (i < n) even += column[i] * u[i];
    u[k] = (u[k] - (even + odd)) * inverse[k];
  }
  return true;
}

bool HessianFactor::minimize(const InputMatrix& hessian, const InputVector& gradient,
                             double* u) noexcept {
  n_ = static_cast<int>(hessian.rows());
  return for_length<1, 2, 3, 4, 9>(
      n_, [&](auto length) { return minimize_as(length, hessian.data(), gradient.data(), u); });
}

// Column k of L^-1, which is row k of J: forward substitution of a unit vector.
void HessianFactor::invert(InputMatrix& j) const noexcept {
  const int n = n_;
  j.resize(n, n);
  double root[even(kMaxInputs)];  // D^-1/2
  for (int k = 0; k < n; ++k) root[k] = std::sqrt(inverse_[k]);
  double x[even(kMaxInputs)];
  double* __restrict rows = j.data();
  for (int k = 0; k < n; ++k) {
    for (int i = 0; i < k; ++i) rows[i * n + k] = 0.0;
    for (int i = k + 1; i < n; ++i) x[i] = 0.0;
    x[k] = 1.0;
    for (int i = k; i < n; ++i) {
      const double s = x[i] * inverse_[i];
      const double* __restrict column = columns_ + i * n;
      for (int l = i + 1; l < n; ++l) x[l] -= s * column[l];
      rows[i * n + k] = x[i] * root[i];
    }
  }
}

}  // namespace photocoag
