#include "photocoag/osqp/condensed.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/qp/tolerances.hpp"

namespace photocoag {
namespace {

// `least` becomes the least squared pivot if that is smaller.
bool positive_definite(const InputMatrix& hessian, double& least) noexcept {
  InputVector pivots;
  if (!cholesky_diagonal(hessian, pivots)) return false;
  for (int k = 0; k < hessian.rows(); ++k) {
    const double pivot = pivots[k];
    if (!(pivot * pivot > kPivot * hessian(k, k))) return false;
    least = std::min(least, pivot * pivot);
  }
  return true;
}

}  // namespace

void CondensedOsqp::prepare(int inputs, int rows, RowPattern pattern) {
  inputs_ = inputs;
  rows_ = rows;
  pattern_ = pattern;
  row_scale_.setOnes(rows);
  SparseProblem qp;
  qp.P.rows = inputs;
  qp.A.rows = inputs + rows;
  for (int j = 0; j < inputs; ++j) {
    for (int i = 0; i <= j; ++i) qp.P.add(i, i == j ? 1.0 : 0.0);
    qp.P.next_column();
    qp.A.add(j, 1.0);
    for (int i = pattern == RowPattern::kFull ? 0 : j; i < rows; ++i) qp.A.add(inputs + i, 1.0);
    qp.A.next_column();
  }
  qp.q.assign(inputs, 0.0);
  qp.lower.assign(inputs + rows, 0.0);
  qp.upper.assign(inputs + rows, 1.0);
  workspace_.set_up(std::move(qp), tolerance_);
}

QpStatus CondensedOsqp::solve(const QpProblem& problem, QpSolution& solution) noexcept {
  solution.iterations = 0;
  QpStatus status = examine(problem);
  const int n = static_cast<int>(problem.hessian.rows());
  const int m = static_cast<int>(problem.rows.rows());
  if (status == QpStatus::kSolved && (n != inputs_ || m != rows_)) {
    try {
      prepare(n, m);
    } catch (const std::exception&) {
      status = QpStatus::kNumericalFailure;
    }
  }
  if (status == QpStatus::kSolved && !fill(problem)) status = QpStatus::kNumericalFailure;
  if (status == QpStatus::kSolved) {
    status = workspace_.solve_checked(true, true, [&] { return read(problem, solution); });
    solution.iterations = workspace_.iterations();
  }
  if (status != QpStatus::kSolved) give_up(problem, solution);
  solution.status = status;
  return status;
}

// The problem with rows over their scales and the objective over its least pivot, so that OSQP's
// absolute residual bounds the error of the power in every direction.
bool CondensedOsqp::fill(const QpProblem& problem) noexcept {
  double least_curvature = std::numeric_limits<double>::infinity();
  if (!positive_definite(problem.hessian, least_curvature)) return false;
  const int n = inputs_;
  const int m = rows_;
  SparseProblem& qp = workspace_.problem();
  objective_scale_ = 1.0 / least_curvature;
  double* P = qp.P.value.data();
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i) *P++ = problem.hessian(i, j) * objective_scale_;
    qp.q[j] = problem.gradient(j) * objective_scale_;
    qp.lower[j] = problem.lower(j);
    qp.upper[j] = problem.upper(j);
  }
  for (int i = 0; i < m; ++i) {
    const bool bounded = problem.limit(i) < std::numeric_limits<double>::infinity();
    double scale = bounded ? std::abs(problem.limit(i)) : 0.0;
    double reach = 0.0;
    for (int j = 0; j < n; ++j) {
      const double box = std::max(std::abs(problem.lower(j)), std::abs(problem.upper(j)));
      reach += std::abs(problem.rows(i, j)) * box;
      if (pattern_ == RowPattern::kLowerTriangular && j > i && problem.rows(i, j) != 0.0) {
        return false;
      }
    }
    scale = std::max(scale, reach);
    row_scale_(i) = scale > 0.0 ? 1.0 / scale : 1.0;
    qp.lower[n + i] = -kOsqpInfinity;
    qp.upper[n + i] = bounded ? problem.limit(i) * row_scale_(i) : kOsqpInfinity;
  }
  double* A = qp.A.value.data();
  for (int j = 0; j < n; ++j) {
    *A++ = 1.0;
    for (int i = pattern_ == RowPattern::kFull ? 0 : j; i < m; ++i) {
      *A++ = problem.rows(i, j) * row_scale_(i);
    }
  }
  return true;
}

bool CondensedOsqp::read(const QpProblem& problem, QpSolution& solution) noexcept {
  const int n = inputs_;
  solution.power.resize(n);
  solution.bound_multiplier.resize(n);
  solution.row_multiplier.resize(rows_);
  const double* x = workspace_.x();
  const double* y = workspace_.y();
  for (int j = 0; j < n; ++j) {
    solution.power(j) = std::clamp(x[j], problem.lower(j), problem.upper(j));
    solution.bound_multiplier(j) = y[j] / objective_scale_;
  }
  for (int i = 0; i < rows_; ++i) {
    const bool bounded = problem.limit(i) < std::numeric_limits<double>::infinity();
    solution.row_multiplier(i) =
        bounded ? std::max(y[n + i], 0.0) * row_scale_(i) / objective_scale_ : 0.0;
  }
  return polisher_.polish(problem, solution);
}

}  // namespace photocoag
