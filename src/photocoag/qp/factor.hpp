// Role: online; root-free Cholesky factors of the Hessian, the unconstrained minimizer, and
// triangular solves, which `dense` needs only if that minimizer is infeasible. Used by qp/dense,
// qp/active_factor.
// Units: none. Real time: noexcept, O(n^3) once and O(n^2) a solution, no heap. Sums run in an
// order that depends on the sizes only: same input, same bits. Threads: one owner.
#pragma once

#include <type_traits>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/qp/problem.hpp"
#include "photocoag/qp/sums.hpp"

namespace photocoag {

/// Sum of column_i x_i, i < k, with the last product added last: it becomes available last.
inline double eliminated(const double* __restrict column, const double* __restrict x,
                         int k) noexcept {
  if (k == 0) return 0.0;
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
  return sum + column[k - 1] * x[k - 1];
}

/// H = C D^-1 C', C upper triangular with D, the pivots, on its diagonal; U = C D^-1/2, H = U U'.
/// The last input is eliminated first, so that U^-1 keeps the trailing zeros of constraints that
/// involve only the first inputs, as those of a plan's first stages.
class HessianFactor {
 public:
  /// False if a pivot is below 1e-14 of its diagonal element: H is not positive definite. `u` is
  /// then undefined, else -H^-1 g. Reads the upper triangle of H.
  bool minimize(const InputMatrix& hessian, const InputVector& gradient, double* u) noexcept;

  /// After minimize() returned true and before solve() and solve_transposed(): takes the roots.
  void prepare_solutions() noexcept;
  /// x <- U^-1 x, where only the first `count` entries of x are not 0; `length`: n, perhaps a
  /// compile-time constant (core/fixed_length.hpp).
  template <typename Length>
  void solve(Length length, double* __restrict x, int count) const noexcept;
  /// x <- U^-T x, n entries.
  template <typename Length>
  void solve_transposed(Length length, double* __restrict x) const noexcept;

 private:
  template <typename Length>
  bool minimize_as(Length length, const double* hessian, const double* gradient,
                   double* u) noexcept;

  int n_ = 0;
  // Columns, n apart: of C, and then of C D^-1, whose diagonal of ones is not written.
  double columns_[even(kMaxInputs) * even(kMaxInputs)];
  double inverse_[even(kMaxInputs)];  // 1 / D
  double root_[even(kMaxInputs)];     // D^-1/2
};

template <typename Length>
inline void HessianFactor::solve(Length length, double* __restrict x, int count) const noexcept {
  // A compile-time length is run through in full: the trailing zeros stay zero.
  constexpr bool kKnown = !std::is_same_v<Length, int>;
  const double* __restrict c = columns_;
  const int n = length;
  const int last = kKnown ? n : count;
  PHOTOCOAG_UNROLLED
  for (int k = last - 1; k >= 0; --k) {
    const double s = x[k];
    PHOTOCOAG_UNROLLED
    for (int i = 0; i < k; ++i) x[i] -= s * c[k * n + i];
    x[k] = s * root_[k];
  }
}

template <typename Length>
inline void HessianFactor::solve_transposed(Length length, double* __restrict x) const noexcept {
  const int n = length;
  PHOTOCOAG_UNROLLED
  for (int k = 0; k < n; ++k) {
    x[k] = x[k] * root_[k] - eliminated(columns_ + k * n, x, k);
  }
}

}  // namespace photocoag
