// Role: online; QR factors of the active constraint normals of a dual active-set method, and its
// step directions. Used by qp/dense.
// Source: Goldfarb and Idnani (qp/dense.hpp), section 4, in the form that is cheap where few of
//   many constraints are active: instead of J = U^-T Q' with its n columns only those of Q that
//   belong to active normals, by Gram and Schmidt, twice where the first time cancels.
// Units: none. Real time: noexcept, O(n^2) at most, no heap. Sums run in an order that depends on
//   the problem only: same input, same bits. Threads: one owner.
#pragma once

#include "photocoag/qp/factor.hpp"

namespace photocoag {

/// `scale` times the row, whose entries are `stride` apart, or, without one, the unit vector
/// `index`.
struct Normal {
  const double* row = nullptr;
  int stride = 1;
  int index = 0;
  double scale = 1.0;
};

/// U^-1 N = Q R with H = U U', N the active normals, n x q; Q'Q = I, R upper triangular.
class ActiveFactor {
 public:
  /// No active normal, `inputs` inputs.
  void clear(int inputs) noexcept;
  int count() const noexcept { return count_; }

  /// Step directions for an entering normal n: w = U^-1 n = Q d1 + v, Q'v = 0.
  void direct(const HessianFactor& factor, const Normal& normal) noexcept;
  /// z = U^-T v: u moves along -z.
  const double* primal() const noexcept { return primal_; }
  /// r = R^-1 d1: the multipliers move along -r.
  const double* dual() const noexcept { return dual_; }
  /// v'v = n'z.
  double slope() const noexcept { return slope_; }
  /// True if the normal lies in the span of the active ones: sine of the angle (in H^-1) up to
  /// 1e-10.
  bool dependent() const noexcept { return dependent_; }

  /// Appends the normal of the last direct(). Precondition: not dependent().
  void add() noexcept;
  void drop(int position) noexcept;

  /// The step to the stationary point on the active set: du from e1 = -(H u + g + N m), n entries,
  /// which it replaces, and dm, q entries, from e2 = b - N'u, which it replaces.
  ///   H du + N dm = e1,  N'du = e2;  with U'du = y:  Q'y = y1 = R^-T e2,  R dm = Q'U^-1 e1 - y1.
  void correct(const HessianFactor& factor, double* e1, double* e2) const noexcept;

 private:
  template <typename Length>
  void direct_as(Length inputs, const HessianFactor& factor, const Normal& normal) noexcept;
  template <typename Length>
  double project(Length length, bool again, double* v) noexcept;
  template <typename Length>
  void solve_r(Length inputs, double* x) const noexcept;

  int n_ = 0;
  int count_ = 0;
  int length_ = 0;                           // of Q's columns; the rest is 0
  double q_[even(kMaxInputs) * kMaxInputs];  // columns, n apart
  double r_[even(kMaxInputs) * kMaxInputs];  // columns, n apart
  double inverse_[even(kMaxInputs)];         // of R's diagonal
  double v_[even(kMaxInputs)] = {};          // the last normal's
  double d1_[even(kMaxInputs)] = {};
  double primal_[even(kMaxInputs)] = {};
  double dual_[even(kMaxInputs)] = {};
  int direction_length_ = 0;
  double slope_ = 0.0;
  bool dependent_ = false;
};

}  // namespace photocoag
