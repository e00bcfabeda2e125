// Role: online; `dense`, the exact and bounded solver of the condensed quadratic program.
// Used by mpc.
// Source: D. Goldfarb, A. Idnani, "A numerically stable dual method for solving strictly convex
//   quadratic programs", Math. Programming 27 (1983) 1-33, steps 0 to 2 of the algorithm.
// Differences from the source: an unconstrained minimizer that satisfies box and rows is the
// answer; inequalities read n' u <= b; J is not made: see active_factor.hpp; bounds are unit
//   vectors; rows that no u in the box can violate are skipped, and so are rows without reach
//   (problem.hpp) whose limit is rounding; rows in conflict by less than 1e-9 are relaxed; an
//   answer whose KKT residual is above 1e-14 is refined once against H, g and the active set; every
//   answer is verified, by the KKT conditions or a Farkas vector.
// Units: none. Rows are normalized, and every tolerance is relative to the data, so that scaling
//   (G_i, limit_i) or (H, g) by a positive factor changes u by rounding only.
// Real time: no heap, lock, exception or clock; at most iteration_bound(n, m) active-set changes
//   of O(n (n + m)) operations after O(n^3) of preparation. Sums run in an order that depends on
//   n and m only, not on alignment: same problem, same bits. Nothing is kept between solves.
// Threads: one object per thread (about 60 KB of work space inside it).
#pragma once

#include "photocoag/core/real_time.hpp"
#include "photocoag/qp/active_factor.hpp"
#include "photocoag/qp/factor.hpp"
#include "photocoag/qp/problem.hpp"

namespace photocoag {

class DenseSolver {
 public:
  /// `iteration_limit`: on top of iteration_bound(), for tests.
  explicit DenseSolver(int iteration_limit = std::numeric_limits<int>::max()) noexcept
      : iteration_limit_(iteration_limit) {}

  /// Most active-set changes for n inputs and m rows; a problem that needs more ends with
  /// kIterationLimit. Random problems of the largest size with half the constraints active needed
  /// 2.5 (n + m); the rest is margin for degenerate ones (tests/qp/test_dense.cpp).
  static constexpr int iteration_bound(int inputs, int constraints) noexcept {
    return 8 * (inputs + constraints) + 16;
  }

  /// Minimizer of 1/2 u' H u + g' u in the box and below the limits, with multipliers:
  ///   H u + g + G' row_multiplier + bound_multiplier = 0.
  /// The scale of row i is max(|limit_i|, sum_j |G_ij| max(|lower_j|, |upper_j|)).
  ///   kSolved: lower <= u <= upper; rows hold to rounding, or, if that is infeasible, to 1e-9 of
  ///   their scale; stationarity to 1e-11 of the largest terms that cancel in it. kInfeasible:
  ///   proved by multipliers; every u in the box violates some row by more than 1e-9 of the row's
  ///   scale. A smaller infeasibility counts as feasible. kIterationLimit, kNumericalFailure,
  ///   kKktFailed: as in QpStatus.
  /// Example and tests: tests/qp/test_dense.cpp.
  QpStatus solve(const QpProblem& problem, QpSolution& solution) noexcept PHOTOCOAG_NONBLOCKING;

 private:
  friend struct DenseSolverProbe;  // tests: the iterate at a stop before the end

  /// n' u <= b. index < n_: bound of input `index`, n = sign e_index; else row index - n_.
  struct Constraint {
    int index = -1;
    double sign = 1.0;
  };

  struct DualStep {
    double length;
    int leaving;  // position in the active set of the first multiplier to reach 0
  };

  QpStatus prepare(const QpProblem& problem) noexcept;
  template <typename Inputs, typename Rows>
  QpStatus prepare_as(const QpProblem& problem, Inputs inputs, Rows rows) noexcept;
  bool take_inner(const QpProblem& problem, QpSolution& solution) const noexcept;
  QpStatus iterate(const QpProblem& problem, int limit, QpSolution& solution) noexcept;
  bool conclude(const QpProblem& problem, double largest, QpSolution& solution) const noexcept;

  struct Worst {
    int index;
    double excess;
  };

  template <typename Inputs, typename Rows>
  Worst worst(const QpProblem& problem, Inputs inputs, Rows rows, double* excess) const noexcept;
  bool choose_violated(const QpProblem& problem) noexcept;
  double violation(const QpProblem& problem, Constraint c) const noexcept;
  double least_counted(const QpProblem& problem, int index) const noexcept;
  DualStep longest_dual_step() const noexcept;
  double least_violation(const QpProblem& problem) const noexcept;
  void relax(const QpProblem& problem, double gap) noexcept;
  void evaluate_directions(const QpProblem& problem) noexcept;
  void add_entering() noexcept;
  void drop(int position) noexcept;
  void refine(const QpProblem& problem) noexcept;
  void add_normal(const QpProblem& problem, Constraint c, double factor,
                  double* target) const noexcept;

  int iteration_limit_;
  int iterations_ = 0;
  int n_ = 0;

  HessianFactor factor_;

  // The constraints, normalized: G_i / scale_i u <= offset_i.
  InputVector box_scale_;   // n, max(|lower|, |upper|)
  InputVector box_weight_;  // 1 / that
  InputVector offsets_;     // m, limit_i / scale_i; infinite: no u in the box violates the row
  double margin_[even(kMaxInputs)];  // m, what relax() added beyond the conflict
  bool relaxed_ = false;
  InputVector row_weights_;  // m, 1 / scale_i

  // The iterate: u, the active set and its multipliers, and the constraint that is entering.
  InputVector u_;
  Constraint active_[kMaxInputs];
  double multiplier_[kMaxInputs] = {};
  Constraint entering_;
  double entering_multiplier_ = 0.0;

  ActiveFactor normals_;
  int first_[kMaxInputs] = {};  // entries of a column of the rows before this one are 0
};

}  // namespace photocoag
