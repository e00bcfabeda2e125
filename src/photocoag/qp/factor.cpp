#include "photocoag/qp/factor.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/qp/sums.hpp"
#include "photocoag/qp/tolerances.hpp"

namespace photocoag {
namespace {

constexpr int kBlock = 4;  // columns that are eliminated together

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
    u[k] = u[k] * inverse[k];
    if (k > 0) u[k] -= eliminated(column, u, k) * inverse[k];
  }
  return true;
}

bool HessianFactor::minimize(const InputMatrix& hessian, const InputVector& gradient,
                             double* u) noexcept {
  n_ = static_cast<int>(hessian.rows());
  return for_length<1, 2, 3, 4, 9>(
      n_, [&](auto length) { return minimize_as(length, hessian.data(), gradient.data(), u); });
}

void HessianFactor::prepare_solutions() noexcept {
  for_length<2, 3, 4, 9>(n_, [&](auto length) {
    const int n = length;
    for (int k = 0; k < n; ++k) root_[k] = std::sqrt(inverse_[k]);
    for (int k = 0; k < n; ++k) {
      for (int i = 0; i < k; ++i) columns_[k * n + i] *= inverse_[k];
    }
  });
}

}  // namespace photocoag
