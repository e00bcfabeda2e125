// Role: online; the quadratic program between the optimal control problem and its solvers.
// Used by mpc (fills it) and every solver. Real time: plain data, no heap.
// Source: docs/equations.md, condensed form of OCP(n).
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <string_view>

#include "photocoag/core/types.hpp"

namespace photocoag {

/// min over u of 1/2 u' H u + g' u  subject to  lower <= u <= upper,  G u <= limit.
///
/// n = H.rows() in 1 … kMaxInputs, H symmetric positive definite (both triangles filled),
/// m = G.rows() in 0 … kMaxInputs. Everything is finite, but a row's limit may be +infinity (no
/// constraint). No unit is assumed: mpc scales u by u_max, so that here lower and upper are of
/// order 1; the rows, and H and g together, may have any scale.
struct QpProblem {
  InputMatrix hessian;   ///< H, n x n
  InputVector gradient;  ///< g, n
  InputVector lower;     ///< n
  InputVector upper;     ///< n, upper >= lower
  InputMatrix rows;      ///< G, m x n
  InputVector limit;     ///< m

  /// Sets all sizes; contents are undefined afterwards. No heap. Throws Error, with the sizes as
  /// they were, unless inputs are 1 … kMaxInputs and constraints 0 … kMaxInputs.
  void resize(int inputs, int constraints);
};

enum class QpStatus {
  kSolved,            ///< u is the minimizer, checked against the KKT conditions
  kInfeasible,        ///< no u satisfies the constraints; u = lower
  kIterationLimit,    ///< the bound on the work was reached; u = lower
  kNumericalFailure,  ///< bad data, or H not positive definite; u = lower
  kKktFailed,         ///< an answer was found but violates the KKT conditions; u = lower
};

std::string_view to_string(QpStatus status) noexcept;

/// Unless solved: multipliers 0, and u_j = min(0, upper_j) where lower_j is not finite.
struct QpSolution {
  InputVector power;             ///< u, n; inside [lower, upper] at every status
  InputVector bound_multiplier;  ///< n; > 0: upper bound active, < 0: lower bound active
  InputVector row_multiplier;    ///< m, >= 0, of G u <= limit
  QpStatus status = QpStatus::kNumericalFailure;
  int iterations = 0;  ///< of the solver: active-set changes or sweeps
  /// Largest scaled violation of the KKT conditions (dimensionless); infinity if not evaluated.
  double kkt_residual = std::numeric_limits<double>::infinity();
};

/// A row that no u in the box moves has no scale of its own: where its reach, sum_j |G_ij| max(
/// |lower_j|, |upper_j|), is this small, its limit counts as 0 down to -kLimitRounding times the
/// largest min(|limit|, reach) of all rows, the rounding of such data.
inline bool without_reach(double reach, double limit) noexcept {
  return reach <= 1e-9 * std::abs(limit);
}
inline constexpr double kLimitRounding = 16.0 * std::numeric_limits<double>::epsilon();

/// True if all sizes are as QpProblem requires.
inline bool sizes_match(const QpProblem& problem) noexcept {
  const Eigen::Index n = problem.hessian.rows();
  const Eigen::Index m = problem.rows.rows();
  const bool inputs = n >= 1 && n <= kMaxInputs && problem.hessian.cols() == n;
  const bool rows = m <= kMaxInputs && (m == 0 || problem.rows.cols() == n);
  // No branches: all conditions hold unless the caller made a mistake.
  return inputs && rows &&
         int(problem.gradient.size() == n) & int(problem.lower.size() == n) &
             int(problem.upper.size() == n) & int(problem.limit.size() == m);
}

/// kSolved if the data are usable; kNumericalFailure if sizes do not match or are above kMaxInputs,
/// or an entry is not finite (a limit may be +infinity); kInfeasible if some lower > upper.
QpStatus examine(const QpProblem& problem) noexcept;

/// The safe answer: every u_j at lower_j (see QpSolution), multipliers 0, no residual.
void give_up(const QpProblem& problem, QpSolution& solution) noexcept;

/// The answer `u` where nothing binds: solved in 0 iterations, multipliers 0.
void write_inner(const QpProblem& problem, const double* u, double kkt_residual,
                 QpSolution& solution) noexcept;

/// A solver: no lock, exception or clock, and no allocation once it has seen the problem's sizes; a
/// bad problem never affects the next answer. The exam is tests/qp/exam.hpp.
template <typename Solver>
concept QpSolver = requires(Solver solver, const QpProblem& problem, QpSolution& solution) {
  { solver.solve(problem, solution) }
  noexcept->std::same_as<QpStatus>;
};

}  // namespace photocoag
