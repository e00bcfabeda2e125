// Role: online; the Cholesky factors of the Hessian without roots, the unconstrained minimizer, and
// solutions with either triangle, which `dense` needs only if that minimizer is outside. Used by
// qp/dense, qp/active_factor.
// Units: none. Real time: noexcept, O(n^3) once and O(n^2) a solution, no heap. Sums run in an
// order that depends on the sizes only: same input, same bits. Threads: one owner.
#pragma once

#include "photocoag/qp/problem.hpp"

namespace photocoag {

/// H = C D^-1 C', C upper triangular with D, the pivots, on its diagonal; U = C D^-1/2, H = U U'.
/// The last input is eliminated first: then U^-1 leaves zeros where a constraint has none but the
/// first inputs in it, as those of the first stages of a plan.
class HessianFactor {
 public:
  /// False if a pivot is below 1e-14 of its diagonal element: H is not positive definite. `u` is
  /// then undefined, else -H^-1 g. Reads the upper triangle of H.
  bool minimize(const InputMatrix& hessian, const InputVector& gradient, double* u) noexcept;

  /// After minimize() was true, before solve() and solve_transposed().
  void take_roots() noexcept;
  /// x <- U^-1 x, where only the first `count` entries of x are not 0; those alone are looked at.
  void solve(double* x, int count) const noexcept;
  /// x <- U^-T x, n entries.
  void solve_transposed(double* x) const noexcept;

 private:
  template <typename Length>
  bool minimize_as(Length length, const double* hessian, const double* gradient,
                   double* u) noexcept;

  int n_ = 0;
  double columns_[even(kMaxInputs) * even(kMaxInputs)];  // of C, n apart
  double inverse_[even(kMaxInputs)];                     // 1 / D
  double root_[even(kMaxInputs)];                        // D^-1/2
};

}  // namespace photocoag
