#include "photocoag/osqp/workspace.hpp"

#include <osqp.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr int kMostIterations = 4000;  // OSQP's default
constexpr double kFinest = 1e-10;
constexpr c_int kRhoInterval = 25;  // iterations, as often as OSQP looks at its residuals

// Larger numbers overflow in OSQP's scaling, which then stays corrupted, and OSQP reports NaN as
// solved.
constexpr double kLargest = 1e15;

bool usable(const std::vector<double>& values) noexcept {
  bool usable = true;
  for (const double v : values) usable &= std::abs(v) <= kLargest || std::abs(v) == kOsqpInfinity;
  return usable;
}

bool all_finite(const double* values, c_int count) noexcept {
  bool finite = true;
  for (c_int i = 0; i < count; ++i) {
    finite &= std::abs(values[i]) < std::numeric_limits<double>::infinity();
  }
  return finite;
}

// The paper's 1e-3 as it is. Finer: the weak directions of a delayed weight leave u0 undetermined
// by the relative residual times a condition of 1e3 (8e-5 W at 1e-6).
double relative(double tolerance) noexcept {
  return tolerance < EPS_REL ? 0.1 * tolerance : tolerance;
}

QpStatus meaning(c_int status) noexcept {
  switch (status) {
    case OSQP_SOLVED:
      return QpStatus::kSolved;
    case OSQP_PRIMAL_INFEASIBLE:
    case OSQP_PRIMAL_INFEASIBLE_INACCURATE:
      return QpStatus::kInfeasible;
    case OSQP_MAX_ITER_REACHED:
    case OSQP_SOLVED_INACCURATE:
      return QpStatus::kIterationLimit;
    default:
      return QpStatus::kNumericalFailure;
  }
}

csc view(const SparseMatrix& matrix, std::vector<c_int>& start, std::vector<c_int>& row,
         std::vector<c_float>& value) {
  start.assign(matrix.start.begin(), matrix.start.end());
  row.assign(matrix.row.begin(), matrix.row.end());
  value.assign(matrix.value.begin(), matrix.value.end());
  csc out{};
  out.nzmax = static_cast<c_int>(value.size());
  out.m = matrix.rows;
  out.n = matrix.columns;
  out.p = start.data();
  out.i = row.data();
  out.x = value.data();
  out.nz = -1;
  return out;
}

}  // namespace

std::size_t SparseMatrix::add(int at_row, double v) {
  row.push_back(at_row);
  value.push_back(v);
  return value.size() - 1;
}

void SparseMatrix::next_column() {
  if (start.empty()) start.push_back(0);
  start.push_back(static_cast<long long>(value.size()));
  ++columns;
}

struct OsqpWorkspace::Handle {
  OSQPWorkspace* work = nullptr;
  bool cold = true;  // nothing to forget; the next solve brings all matrices

  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (work != nullptr) osqp_cleanup(work);
  }
};

OsqpWorkspace::OsqpWorkspace() = default;
OsqpWorkspace::~OsqpWorkspace() = default;
OsqpWorkspace::OsqpWorkspace(OsqpWorkspace&&) noexcept = default;
OsqpWorkspace& OsqpWorkspace::operator=(OsqpWorkspace&&) noexcept = default;

void OsqpWorkspace::set_up(SparseProblem problem, double tolerance) {
  problem_ = std::move(problem);
  tolerance_ = last_tolerance_ = tolerance;
  has_answer_ = false;
  handle_ = std::make_unique<Handle>();
  std::vector<c_int> starts[2];
  std::vector<c_int> rows[2];
  std::vector<c_float> values[2];
  csc P = view(problem_.P, starts[0], rows[0], values[0]);
  csc A = view(problem_.A, starts[1], rows[1], values[1]);
  const OSQPData data{.n = P.n,
                      .m = A.m,
                      .P = &P,
                      .A = &A,
                      .q = problem_.q.data(),
                      .l = problem_.lower.data(),
                      .u = problem_.upper.data()};
  OSQPSettings settings;
  osqp_set_default_settings(&settings);
  settings.adaptive_rho_interval = kRhoInterval;
  settings.max_iter = kMostIterations;
  settings.eps_abs = tolerance;
  settings.eps_rel = relative(tolerance);
  settings.verbose = 0;
  const c_int failure = osqp_setup(&handle_->work, &data, &settings);
  if (failure != 0) {
    throw Error({.key = "control.solver",
                 .problem = "OSQP could not be set up",
                 .found = "OSQP error " + std::to_string(failure),
                 .accepted = "another problem, or control.solver = \"dense\""});
  }
}

QpStatus OsqpWorkspace::solve(bool new_P, bool new_A) noexcept {
  iterations_ = 0;
  has_answer_ = false;
  if (!handle_ || !usable(problem_.q) || !usable(problem_.lower) || !usable(problem_.upper) ||
      !usable(problem_.P.value) || !usable(problem_.A.value)) {
    return QpStatus::kNumericalFailure;
  }
  new_P = new_P || handle_->cold;
  new_A = new_A || handle_->cold;
  OSQPWorkspace* work = handle_->work;
  // q first: the scaling that follows new matrices looks at it.
  c_int failure = osqp_update_lin_cost(work, problem_.q.data());
  failure |= osqp_update_bounds(work, problem_.lower.data(), problem_.upper.data());
  if (new_P && new_A) {
    failure |= osqp_update_P_A(work, problem_.P.value.data(), OSQP_NULL, 0, problem_.A.value.data(),
                               OSQP_NULL, 0);
  } else if (new_A) {
    failure |= osqp_update_A(work, problem_.A.value.data(), OSQP_NULL, 0);
  } else if (new_P) {
    failure |= osqp_update_P(work, problem_.P.value.data(), OSQP_NULL, 0);
  }
  if (failure != 0) {
    forget();
    return QpStatus::kNumericalFailure;
  }
  handle_->cold = false;
  return attempt(tolerance_);
}

QpStatus OsqpWorkspace::refine() noexcept {
  const double tolerance = 0.1 * last_tolerance_;
  has_answer_ = false;
  if (tolerance < kFinest || iterations_ >= kMostIterations) {
    forget();
    return QpStatus::kIterationLimit;
  }
  return attempt(tolerance);
}

QpStatus OsqpWorkspace::attempt(double tolerance) noexcept {
  OSQPWorkspace* work = handle_->work;
  if (tolerance != last_tolerance_) {
    osqp_update_eps_abs(work, tolerance);
    osqp_update_eps_rel(work, relative(tolerance));
    last_tolerance_ = tolerance;
  }
  osqp_update_max_iter(work, kMostIterations - iterations_);
  QpStatus status = QpStatus::kNumericalFailure;
  if (osqp_solve(work) == 0) {
    status = meaning(work->info->status_val);
    iterations_ += static_cast<int>(work->info->iter);
    if (status == QpStatus::kSolved || status == QpStatus::kIterationLimit) {
      has_answer_ = all_finite(x(), work->data->n) && all_finite(y(), work->data->m);
    }
    if (status == QpStatus::kSolved && !has_answer_) status = QpStatus::kNumericalFailure;
  }
  if (status != QpStatus::kSolved) forget();
  return status;
}

void OsqpWorkspace::forget() noexcept {
  if (!handle_ || handle_->cold) return;
  OSQPWorkspace* work = handle_->work;
  for (c_int i = 0; i < work->data->n; ++i) work->x[i] = 0.0;
  for (c_int i = 0; i < work->data->m; ++i) work->z[i] = work->y[i] = 0.0;
  // Reset the scaling to 1, in case it was corrupted: new matrices are scaled from there.
  OSQPScaling& scaling = *work->scaling;
  for (c_int i = 0; i < work->data->n; ++i) scaling.D[i] = scaling.Dinv[i] = 1.0;
  for (c_int i = 0; i < work->data->m; ++i) scaling.E[i] = scaling.Einv[i] = 1.0;
  scaling.c = scaling.cinv = 1.0;
  osqp_update_rho(work, RHO);
  handle_->cold = true;
}

const double* OsqpWorkspace::x() const noexcept { return handle_->work->solution->x; }
const double* OsqpWorkspace::y() const noexcept { return handle_->work->solution->y; }

}  // namespace photocoag
