// Role: online, by choice (`control.solver = "osqp-condensed"`); OSQP on the condensed problem.
// Used by mpc in place of DenseSolver. Source: as workspace.hpp.
// Differences from the paper: condensed; rows and objective are normalized, so that the tolerance
// is relative to the data and not to their units; H is checked to be definite; u is clipped to the
// box, polished, and checked as every solver's. Units: none. Real time: as workspace.hpp,
// allocation-free for sizes that were prepared. Accuracy as `dense`: only answers that pass the
// same check are returned. The last bits, and whether there is an answer, depend on earlier
// problems (warm start).
#pragma once

#include "photocoag/osqp/workspace.hpp"
#include "photocoag/qp/polish.hpp"

namespace photocoag {

enum class RowPattern {
  kFull,
  kLowerTriangular,  ///< G_ij = 0 for j > i, as in every condensed optimal control problem
};

class CondensedOsqp {
 public:
  explicit CondensedOsqp(double tolerance = 1e-3) : tolerance_(tolerance) {}

  /// Sets OSQP up for problems of one size. Allocates; throws Error.
  void prepare(int inputs, int rows, RowPattern pattern = RowPattern::kFull);

  /// As DenseSolver::solve. Sizes that were not prepared are prepared first (allocates); a row that
  /// leaves the pattern is kNumericalFailure. OSQP starts at the tolerance; while the polished
  /// answer fails the solver-independent check (is_optimal in kkt.hpp), it continues with a tenth
  /// of it. kKktFailed if no answer passes within 4000 iterations.
  QpStatus solve(const QpProblem& problem, QpSolution& solution) noexcept;

  /// The next solve starts cold.
  void forget() noexcept { workspace_.forget(); }

 private:
  bool fill(const QpProblem& problem) noexcept;
  bool read(const QpProblem& problem, QpSolution& solution) noexcept;

  double tolerance_;
  int inputs_ = 0;
  int rows_ = 0;
  RowPattern pattern_ = RowPattern::kFull;
  OsqpWorkspace workspace_;
  Polisher polisher_;
  InputVector row_scale_;
  double objective_scale_ = 1.0;
};

}  // namespace photocoag
