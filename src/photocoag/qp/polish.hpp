// Role: online; refines an approximate answer on the active set given by its multipliers, so that
// an iterative solver's answer can meet the same conditions as an exact one. Used by osqp. Source:
// B. Stellato et al., "OSQP", Math. Prog. Comp. 12 (2020) 637-672, section 4
//   (solution polishing).
// Differences: on the dense problem, by its Cholesky factor and a Schur complement; the multipliers
// alone determine the set; it is corrected a few times as in the primal-dual active set method (M.
// Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865-888). Units: none. Real time:
// noexcept, O((n + m)^3), no heap, nothing is kept. Threads: one owner (some 120 KB of work space
// inside it).
#pragma once

#include "photocoag/qp/problem.hpp"

namespace photocoag {

class Polisher {
 public:
  /// Minimizer of 1/2 u' H u + g' u with the constraints whose multiplier in `solution` is not 0
  /// held with equality, its multipliers, and kkt_residual. While that is not the minimizer of
  /// `problem` (is_optimal in kkt.hpp) the set is corrected, nine times at most: constraints with a
  /// multiplier of the wrong sign leave, violated ones enter. True if it is the minimizer; a wrong
  /// set cannot pass. Dependent constraints are allowed. Precondition: sizes match, the problem is
  /// finite (examine() in problem.hpp). False, with `solution` undefined, also if H is not
  /// definite.
  bool polish(const QpProblem& problem, QpSolution& solution) noexcept;

 private:
  static constexpr int kMostActive = even(2 * kMaxInputs);

  static constexpr int kStride = even(kMaxInputs);

  /// a u = b. index < n: the bound of an input, a = sign e_index; else row index - n, sign 1.
  struct Active {
    int index;
    double sign;
    bool fixed;    // lower = upper: a multiplier of either sign is valid
    double scale;  // of a, so that a H^-1 a' = 1
    double value;  // b times scale
  };

  void find_active(const QpProblem& problem, const QpSolution& solution) noexcept;
  bool factorize_hessian(const QpProblem& problem) noexcept;
  bool factorize_active(const QpProblem& problem) noexcept;
  void improve(const QpProblem& problem) noexcept;
  void write(const QpProblem& problem, QpSolution& solution) const noexcept;
  bool correct(const QpProblem& problem) noexcept;
  void take(const QpProblem& problem, int index, double sign, double multiplier) noexcept;
  double normal(const QpProblem& problem, const Active& a, int j) const noexcept;

  int n_ = 0;
  int count_ = 0;
  Active active_[kMostActive];
  double multiplier_[kMostActive];  // of the scaled a: not negative if it is right
  double u_[kStride];
  double hessian_factor_[kStride * kStride];        // L, columns
  double reach_[kMostActive * kStride];             // L^-1 a', one column each
  double schur_factor_[kMostActive * kMostActive];  // of a H^-1 a', regularized
};

}  // namespace photocoag
