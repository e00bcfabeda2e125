#include "photocoag/qp/problem.hpp"

#include <cmath>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <typename Matrix>
bool all_finite(const Matrix& matrix) noexcept {
  bool finite = true;
  const double* data = matrix.data();
  for (int i = 0; i < static_cast<int>(matrix.size()); ++i) finite &= std::abs(data[i]) < kInfinity;
  return finite;
}

}  // namespace

void QpProblem::resize(int inputs, int constraints) {
  if (inputs < 1 || inputs > kMaxInputs || constraints < 0 || constraints > kMaxInputs) {
    throw Error(
        {.where = "quadratic program",
         .problem = "too many or too few inputs or rows",
         .found = std::to_string(inputs) + " inputs, " + std::to_string(constraints) + " rows",
         .accepted = "1 to " + std::to_string(kMaxInputs) + " inputs, 0 to " +
                     std::to_string(kMaxInputs) + " rows"});
  }
  hessian.resize(inputs, inputs);
  gradient.resize(inputs);
  lower.resize(inputs);
  upper.resize(inputs);
  rows.resize(constraints, inputs);
  limit.resize(constraints);
}

QpStatus examine(const QpProblem& problem) noexcept {
  const Eigen::Index n = problem.hessian.rows();
  const Eigen::Index m = problem.rows.rows();
  if (n < 1 || n > kMaxInputs || m > kMaxInputs || problem.hessian.cols() != n ||
      problem.gradient.size() != n || problem.lower.size() != n || problem.upper.size() != n ||
      problem.limit.size() != m || (m > 0 && problem.rows.cols() != n)) {
    return QpStatus::kNumericalFailure;
  }
  if (!all_finite(problem.hessian) || !all_finite(problem.gradient) || !all_finite(problem.lower) ||
      !all_finite(problem.upper) || !all_finite(problem.rows)) {
    return QpStatus::kNumericalFailure;
  }
  for (int i = 0; i < m; ++i) {
    if (!(problem.limit(i) > -kInfinity)) return QpStatus::kNumericalFailure;
  }
  for (int j = 0; j < n; ++j) {
    if (problem.lower(j) > problem.upper(j)) return QpStatus::kInfeasible;
  }
  return QpStatus::kSolved;
}

void give_up(const QpProblem& problem, QpSolution& solution) noexcept {
  const Eigen::Index n = problem.hessian.rows();
  solution.power.resize(n);
  for (int j = 0; j < n; ++j) {
    const double lower = j < problem.lower.size() ? problem.lower(j) : 0.0;
    const double upper = j < problem.upper.size() ? problem.upper(j) : 0.0;
    solution.power(j) = std::abs(lower) < kInfinity ? lower : (upper < 0.0 ? upper : 0.0);
  }
  solution.bound_multiplier.setZero(n);
  solution.row_multiplier.setZero(problem.rows.rows());
  solution.kkt_residual = kInfinity;
}

std::string_view to_string(QpStatus status) noexcept {
  switch (status) {
    case QpStatus::kSolved:
      return "solved";
    case QpStatus::kInfeasible:
      return "infeasible";
    case QpStatus::kIterationLimit:
      return "iteration-limit";
    case QpStatus::kNumericalFailure:
      return "numerical-failure";
    case QpStatus::kKktFailed:
      return "kkt-failed";
  }
  return "unknown";
}

}  // namespace photocoag
