// Role: online, by choice (`control.solver = "osqp"`); one OSQP problem whose pattern is fixed and
// whose numbers are replaced in place. Used by condensed and sparse.
// Source: B. Stellato, G. Banjac, P. Goulart, A. Bemporad, S. Boyd, "OSQP: an operator splitting
//   solver for quadratic programs", Math. Prog. Comp. 12 (2020) 637-672; OSQP 0.6.
// Settings: OSQP's defaults, but the step size is adapted every 25 iterations (by default the
//   interval follows measured time) and the tolerance is the caller's.
// Units: none. Real time: set_up() allocates and may throw; solve() is noexcept and bounded (4000
//   iterations) and, with an OSQP built without its profiling and interrupt options as the
//   photocoag script builds it, free of heap, clock and signal handlers (tests/osqp). Not bit for
//   bit the same from any history: OSQP starts from its last answer. Threads: one owner.
#pragma once

#include <memory>
#include <vector>

#include "photocoag/qp/problem.hpp"

namespace photocoag {

/// Compressed columns; entries may be zero and stay in the pattern.
struct SparseMatrix {
  int rows = 0;
  int columns = 0;
  std::vector<long long> start;  ///< columns + 1
  std::vector<long long> row;    ///< ascending in each column
  std::vector<double> value;

  /// Appends an entry to the last column; returns its position in `value`.
  std::size_t add(int at_row, double v);
  void next_column();
};

/// min 1/2 x' P x + q' x  subject to  lower <= A x <= upper; P is the upper triangle.
struct SparseProblem {
  SparseMatrix P;
  std::vector<double> q;
  SparseMatrix A;
  std::vector<double> lower;
  std::vector<double> upper;
};

/// No constraint, for `lower` and `upper`.
inline constexpr double kOsqpInfinity = 1e30;

class OsqpWorkspace {
 public:
  OsqpWorkspace();
  ~OsqpWorkspace();
  OsqpWorkspace(OsqpWorkspace&&) noexcept;
  OsqpWorkspace& operator=(OsqpWorkspace&&) noexcept;

  /// Takes the pattern and first numbers. Throws Error if OSQP refuses them.
  void set_up(SparseProblem problem, double tolerance);

  /// What the next solve() uses; sizes and patterns must stay.
  SparseProblem& problem() noexcept { return problem_; }

  /// Pushes q and the bounds, P and A only if said to, and solves from the last answer. After any
  /// other answer than kSolved the next solve starts cold.
  ///   kInfeasible: proved to OSQP's tolerance; kIterationLimit: 4000 iterations, or solved with a
  ///   lower accuracy only; kNumericalFailure: anything else, or data beyond 1e15.
  QpStatus solve(bool new_P, bool new_A) noexcept;

  /// The next solve starts from x = 0, y = 0 and the default step size.
  void forget() noexcept;

  /// Only after kSolved: otherwise OSQP leaves 2143289344 in them.
  const double* x() const noexcept;
  const double* y() const noexcept;
  int iterations() const noexcept;
  /// The larger of OSQP's primal and dual residuals, which it compares with its tolerances.
  double residual() const noexcept;

 private:
  struct Handle;
  SparseProblem problem_;
  std::unique_ptr<Handle> handle_;
};

}  // namespace photocoag
