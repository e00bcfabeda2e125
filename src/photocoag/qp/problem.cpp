#include "photocoag/qp/problem.hpp"

#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/fixed_length.hpp"

namespace photocoag {
namespace {

template <typename Matrix>
bool all_finite(const Matrix& matrix) noexcept {
  const double* data = matrix.data();
  const int size = static_cast<int>(matrix.size());
  double zero[4] = {};  // 0 times what is not finite is NaN
  int i = 0;
  for (; i + 3 < size; i += 4) {
    for (int k = 0; k < 4; ++k) zero[k] += 0.0 * data[i + k];
  }
  for (; i < size; ++i) zero[0] += 0.0 * data[i];
  return zero[0] + zero[1] + zero[2] + zero[3] == 0.0;
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
  if (!sizes_match(problem)) return QpStatus::kNumericalFailure;
  const Eigen::Index n = problem.hessian.rows();
  const Eigen::Index m = problem.rows.rows();
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

void write_inner(const QpProblem& problem, const double* u, double kkt_residual,
                 QpSolution& solution) noexcept {
  const int m = static_cast<int>(problem.limit.size());
  solution.power.resize(problem.gradient.size());
  solution.bound_multiplier.resize(problem.gradient.size());
  solution.row_multiplier.resize(m);
  for_length<1, 2, 3, 4>(static_cast<int>(problem.gradient.size()), [&](auto length) {
    const int n = length;
    for (int j = 0; j < n; ++j) {
      solution.power.data()[j] = u[j];
      solution.bound_multiplier.data()[j] = 0.0;
    }
  });
  for (int i = 0; i < m; ++i) solution.row_multiplier.data()[i] = 0.0;
  solution.kkt_residual = kkt_residual;
  solution.iterations = 0;
  solution.status = QpStatus::kSolved;
}

std::string_view to_string(QpStatus status) noexcept {
  constexpr std::string_view names[] = {"solved", "infeasible", "iteration-limit",
                                        "numerical-failure", "kkt-failed"};
  return names[static_cast<std::size_t>(status)];
}

}  // namespace photocoag
