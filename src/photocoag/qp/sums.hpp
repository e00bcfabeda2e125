// Role: online; sums over plain arrays for qp. Plain loops, not Eigen's reductions: those start at
// an aligned address, so that the order of the sum, and its last bit, would depend on the object's
// address. Real time: noexcept, no heap; the order depends on the length only.
#pragma once

namespace photocoag {

inline double dot(const double* __restrict a, const double* __restrict b, int n) noexcept {
  double sum[4] = {};
  int i = 0;
  for (; i + 3 < n; i += 4) {
    for (int k = 0; k < 4; ++k) sum[k] += a[i + k] * b[i + k];
  }
  for (int k = 0; i < n; ++i, ++k) sum[k] += a[i] * b[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/// y <- y + s x.
inline void axpy(double s, const double* __restrict x, double* __restrict y, int n) noexcept {
  for (int i = 0; i < n; ++i) y[i] += s * x[i];
}

}  // namespace photocoag
