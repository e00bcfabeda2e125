// Role: online; the Cholesky factors of the Hessian without roots, the unconstrained minimizer, and
// J = L^-T, which `dense` needs only if that minimizer is outside. Used by qp/dense.
// Units: none. Real time: noexcept, O(n^3), no heap. Sums run in an order that depends on n only:
// same input, same bits. Threads: one owner.
#pragma once

#include "photocoag/qp/problem.hpp"

namespace photocoag {

/// H = C D^-1 C', C lower triangular with D, the pivots, on its diagonal; L = C D^-1/2.
class HessianFactor {
 public:
  /// False if a pivot is below 1e-14 of its diagonal element: H is not positive definite. `u` is
  /// then undefined, else -H^-1 g. Reads the lower triangle of H.
  bool minimize(const InputMatrix& hessian, const InputVector& gradient, double* u) noexcept;

  /// J = L^-T, n x n, upper triangular, after minimize() was true: J' H J = I.
  void invert(InputMatrix& j) const noexcept;

 private:
  template <typename Length>
  bool minimize_as(Length length, const double* hessian, const double* gradient,
                   double* u) noexcept;

  int n_ = 0;
  double columns_[even(kMaxInputs) * even(kMaxInputs)];  // of C, n apart
  double inverse_[even(kMaxInputs)];                     // 1 / D
};

}  // namespace photocoag
