// Role: online, by choice (`control.solver = "osqp"`); one OSQP problem with a fixed sparsity
// pattern, its values replaced in place. Used by condensed and sparse.
// Source: B. Stellato, G. Banjac, P. Goulart, A. Bemporad, S. Boyd, "OSQP: an operator splitting
//   solver for quadratic programs", Math. Prog. Comp. 12 (2020) 637-672; OSQP 0.6.
// Settings: OSQP's defaults, but the step size is adapted every 25 iterations (by default the
//   interval follows measured time) and the tolerance is the caller's.
// Units: none. Real time: set_up() allocates and may throw; solve() is noexcept and bounded (4000
//   iterations) and, with an OSQP built without its profiling and interrupt options as the
//   photocoag script builds it, free of heap, clock and signal handlers (tests/osqp). Results
//   depend on the history in their last bits: OSQP starts from its last answer. Threads: one owner.
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

/// In `lower` and `upper`: no bound.
inline constexpr double kOsqpInfinity = 1e30;

class OsqpWorkspace {
 public:
  OsqpWorkspace();
  ~OsqpWorkspace();
  OsqpWorkspace(OsqpWorkspace&&) noexcept;
  OsqpWorkspace& operator=(OsqpWorkspace&&) noexcept;

  /// Takes the pattern and first numbers. Throws Error if OSQP refuses them.
  void set_up(SparseProblem problem, double tolerance);

  /// The data of the next solve(); sizes and patterns must not change.
  SparseProblem& problem() noexcept { return problem_; }

  /// Passes q and the bounds to OSQP, P and A only as flagged, and solves from the last answer.
  /// After any other answer than kSolved the next solve starts cold.
  ///   kInfeasible: proved to OSQP's tolerance; kIterationLimit: 4000 iterations, or solved with a
  ///   lower accuracy only; kNumericalFailure: anything else, or data beyond 1e15.
  QpStatus solve(bool new_P, bool new_A) noexcept;

  /// Goes on from the last solve() or refine() with a tenth of its tolerance. kIterationLimit when
  /// the 4000 iterations of all attempts are used up or a tolerance of 1e-10 was not enough.
  /// Precondition: the last status was kSolved.
  QpStatus refine() noexcept;

  /// solve(), then refine() while `passes` (bool(), reads x and y) rejects the answer. kSolved: the
  /// last answer passed. kKktFailed: no answer passed.
  template <typename Passes>
  QpStatus solve_checked(bool new_P, bool new_A, Passes&& passes) noexcept {
    QpStatus status = solve(new_P, new_A);
    while (has_answer()) {
      if (passes()) return QpStatus::kSolved;
      if (status != QpStatus::kSolved) break;
      status = refine();
      if (!has_answer()) break;
    }
    const bool refused = status == QpStatus::kSolved || status == QpStatus::kIterationLimit;
    return refused ? QpStatus::kKktFailed : status;
  }

  /// The next solve starts from x = 0, y = 0 and the default step size.
  void forget() noexcept;

  /// True if x and y hold an answer, even an inaccurate one: after kSolved and after
  /// kIterationLimit of an attempt. Otherwise OSQP leaves 2143289344 in them.
  bool has_answer() const noexcept { return has_answer_; }
  const double* x() const noexcept;
  const double* y() const noexcept;
  /// Of the last solve() and the refine() after it.
  int iterations() const noexcept { return iterations_; }

 private:
  struct Handle;
  QpStatus attempt(double tolerance) noexcept;

  SparseProblem problem_;
  double tolerance_ = 1e-3;      // of solve()
  double last_tolerance_ = 0.0;  // of the last attempt
  int iterations_ = 0;
  bool has_answer_ = false;
  std::unique_ptr<Handle> handle_;
};

}  // namespace photocoag
