// Role: online; convolution with an impulse response. Used by the plans where nothing binds. Real
// time: noexcept, O(n^2), no allocation; each sum in the order of the inputs.
#pragma once

#include "photocoag/core/fixed_length.hpp"

namespace photocoag {

/// y_k = sum_(j <= k) h_(k-j) x_j for k = 0 ... n - 1.
inline void respond_to(const double* __restrict h, const double* __restrict x, int n,
                       double* __restrict y) noexcept {
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) y[k] = 0.0;
  PHOTOCOAG_UNROLLED
  for (int j = 0; j < n; ++j) {
    const double value = x[j];
    PHOTOCOAG_UNROLLED
    for (int k = j; k < n; ++k) y[k] += h[k - j] * value;
  }
}

}  // namespace photocoag
