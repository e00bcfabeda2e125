#include "photocoag/qp/dense.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/qp/kkt.hpp"

namespace photocoag {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// All relative. Rounding in n' u is some 1e-15 of the row's scale for 49 inputs.
constexpr double kViolated = 1e-13;    // a constraint is taken up: two orders above rounding
constexpr double kWide = 10.0;         // a box counts as at most so much larger than u
constexpr double kFeasible = 1e-9;     // rows that cannot be met better than this are infeasible
constexpr double kDependent = 1e-10;   // sine of the angle (in H^-1) to the span of the active set
constexpr double kNegligible = 1e-12;  // components of r that may be rounding errors
constexpr double kInner = 1e-14;       // stationarity of a minimizer that needs no refinement

// Plain loops, not Eigen's reductions: those start at an aligned address, so that the order of the
// sum, and its last bit, would depend on where the object lies.
double dot(const double* a, const double* b, int n) noexcept {
  double sum[4] = {};
  int i = 0;
  for (; i + 3 < n; i += 4) {
    for (int k = 0; k < 4; ++k) sum[k] += a[i + k] * b[i + k];
  }
  for (int k = 0; i < n; ++i, ++k) sum[k] += a[i] * b[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

void axpy(double s, const double* __restrict x, double* __restrict y, int n) noexcept {
  for (int i = 0; i < n; ++i) y[i] += s * x[i];
}

}  // namespace

QpStatus DenseSolver::solve(const QpProblem& problem, QpSolution& solution) noexcept {
  iterations_ = 0;
  bool definite = false;
  if (sizes_match(problem)) {
    u_.resize(problem.hessian.rows());
    definite = factor_.minimize(problem.hessian, problem.gradient, u_.data());
    // In most problems nothing binds. The check looks at all data: what is wrong with them shows.
    if (definite && take_inner(problem, solution)) return QpStatus::kSolved;
  }
  QpStatus status = examine(problem);
  if (status == QpStatus::kSolved) status = prepare(problem);
  if (status == QpStatus::kSolved && !definite) status = QpStatus::kNumericalFailure;
  if (status == QpStatus::kSolved) {
    const int bound = iteration_bound(n_, static_cast<int>(offsets_.size()));
    status = iterate(problem, std::min(iteration_limit_, bound));
  }
  if (status == QpStatus::kSolved) status = conclude(problem, solution);
  if (status != QpStatus::kSolved) give_up(problem, solution);
  solution.iterations = iterations_;
  solution.status = status;
  return status;
}

// The unconstrained minimizer, where it is inside of everything.
bool DenseSolver::take_inner(const QpProblem& problem, QpSolution& solution) const noexcept {
  const double residual = inner_residual(problem, u_.data());
  if (!(residual <= kInner)) return false;
  write_inner(problem, u_.data(), residual, solution);
  return true;
}

// Scales the box and the rows. A row that no u in the box violates is left out: its offset is
// infinite.
QpStatus DenseSolver::prepare(const QpProblem& problem) noexcept {
  const int n = n_ = static_cast<int>(problem.hessian.rows());
  const int m = static_cast<int>(problem.rows.rows());
  box_scale_.resize(n);
  box_weight_.resize(n);
  double most[even(kMaxInputs)];   // largest G_i u in the box
  double reach[even(kMaxInputs)];  // sum_j |G_ij| max(|lower_j|, |upper_j|)
  std::fill_n(most, m, 0.0);
  std::fill_n(reach, m, 0.0);
  for (int j = 0; j < n; ++j) {
    const double lower = problem.lower(j);
    const double upper = problem.upper(j);
    const double scale = std::max(std::abs(lower), std::abs(upper));
    box_scale_(j) = scale > 0.0 ? scale : 1.0;
    box_weight_(j) = 1.0 / box_scale_(j);
    const double* column = problem.rows.data() + j * m;
    for (int i = 0; i < m; ++i) {
      most[i] += std::max(column[i] * lower, column[i] * upper);
      reach[i] += std::abs(column[i]) * scale;
    }
  }

  offsets_.resize(m);
  row_weights_.resize(m);
  double known = 0.0;
  for (int i = 0; i < m; ++i) {
    known = std::max(known, std::min(std::abs(problem.limit(i)), reach[i]));
  }
  for (int i = 0; i < m; ++i) {
    const double limit = problem.limit(i);
    const double least = without_reach(reach[i], limit) ? -kLimitRounding * known : most[i];
    const bool left_out = limit >= std::min(least, most[i]);
    const double scale = left_out ? 1.0 : std::max(std::abs(limit), reach[i]);
    if (!(scale < kInfinity)) return QpStatus::kNumericalFailure;
    row_weights_(i) = 1.0 / scale;
    offsets_(i) = left_out ? kInfinity : limit * row_weights_(i);
  }
  std::fill_n(is_active_, n + m, false);
  return QpStatus::kSolved;
}

// The algorithm of Goldfarb and Idnani. kSolved: nothing is violated; optimality is unchecked.
QpStatus DenseSolver::iterate(const QpProblem& problem, int limit) noexcept {
  const int n = n_;
  // Step 0: u is the unconstrained minimum.
  active_count_ = 0;
  d_.resize(n);
  z_.resize(n);
  dual_.resize(n);
  normal_.resize(n);
  factor_.invert(j_);
  r_.resize(n, n);

  bool entering = false;
  for (iterations_ = 0; iterations_ <= limit; ++iterations_) {
    // Step 1: choose a violated constraint; if there is none, refine u and look again.
    if (!entering) {
      if (!choose_violated(problem)) {
        refine(problem);
        if (!choose_violated(problem)) return QpStatus::kSolved;
      }
      entering = true;
      entering_multiplier_ = 0.0;
    }
    if (iterations_ == limit) break;

    // Step 2a: the step direction in primal and dual space.
    evaluate_directions();

    // Step 2b: the step length. t1 keeps the multipliers positive, t2 ends the violation.
    const auto [t1, leaving] = longest_dual_step();
    const double t2 = dependent_ ? kInfinity : violation(problem, entering_) / d2_squared_;
    const double t = std::min(t1, t2);

    // Step 2c: no step, a step in dual space, or a step in both.
    if (t == kInfinity) {
      const double gap = least_violation(problem);
      if (gap > kFeasible) return QpStatus::kInfeasible;
      // Out of step with the proof, or p would have to leave again: only rounding leads here.
      if (!(gap >= -kFeasible) || entering_multiplier_ > 0.0) return QpStatus::kNumericalFailure;
      relax(problem, gap);
      refine(problem);
      entering = false;
      continue;
    }
    if (!dependent_) axpy(-t, z_.data(), u_.data(), n);
    axpy(-t, dual_.data(), multiplier_, active_count_);
    entering_multiplier_ += t;
    if (t == t2) {
      add_entering();
      entering = false;
    } else {
      drop(leaving);
    }
  }
  return QpStatus::kIterationLimit;
}

// kViolated, or less where the box is far wider than u: of what rounds in a constraint there.
double DenseSolver::least_counted(const QpProblem& problem, int index) const noexcept {
  const int n = n_;
  const double curved = curved_size(problem, u_.data());
  const auto size = [&](int j) {
    return std::min(box_scale_(j), kWide * curved / std::sqrt(problem.hessian(j, j)));
  };
  if (index < n) return kViolated * size(index) / box_scale_(index);
  const int i = index - n;
  double sum = kWide * std::abs(offsets_(i));
  for (int j = 0; j < n; ++j) sum += std::abs(problem.rows(i, j)) * row_weights_(i) * size(j);
  return kViolated * std::min(sum, 1.0);
}

// The constraint with the largest violation relative to its scale; false if there is none.
bool DenseSolver::choose_violated(const QpProblem& problem) noexcept {
  const int n = n_;
  double largest = 0.0;
  for (int j = 0; j < n; ++j) {
    if (is_active_[j]) continue;
    const double above = u_(j) - problem.upper(j);
    const double below = problem.lower(j) - u_(j);
    const double scaled = std::max(above, below) * box_weight_(j);
    if (scaled > largest && (scaled > kViolated || scaled > least_counted(problem, j))) {
      largest = scaled;
      entering_ = {j, above > below ? 1.0 : -1.0};
    }
  }
  const int m = static_cast<int>(offsets_.size());
  double value[even(kMaxInputs)];  // G u
  for (int i = 0; i < m; ++i) value[i] = 0.0;
  for (int j = 0; j < n; ++j) axpy(u_(j), problem.rows.data() + j * m, value, m);
  for (int i = 0; i < m; ++i) {
    if (is_active_[n + i]) continue;
    const double scaled = value[i] * row_weights_(i) - offsets_(i);
    if (scaled > largest && (scaled > kViolated || scaled > least_counted(problem, n + i))) {
      largest = scaled;
      entering_ = {n + i, 1.0};
    }
  }
  if (!(largest > 0.0)) return false;
  normal_.setZero();
  add_normal(problem, entering_, 1.0, normal_.data());
  return true;
}

// n' u - b.
double DenseSolver::violation(const QpProblem& problem, Constraint c) const noexcept {
  if (c.index >= n_) {
    const int i = c.index - n_;
    double sum = 0.0;
    for (int j = 0; j < n_; ++j) sum += problem.rows(i, j) * u_(j);
    return sum * row_weights_(i) - offsets_(i);
  }
  return c.sign > 0.0 ? u_(c.index) - problem.upper(c.index) : problem.lower(c.index) - u_(c.index);
}

// d = J' n, z = J2 d2, r = R^-1 d1.
void DenseSolver::evaluate_directions() noexcept {
  const int n = n_;
  const int q = active_count_;
  if (entering_.index < n) {
    for (int k = 0; k < n; ++k) d_(k) = entering_.sign * j_(entering_.index, k);
  } else {
    for (int k = 0; k < n; ++k) d_(k) = dot(j_.data() + k * n, normal_.data(), n);
  }
  d2_squared_ = dot(d_.data() + q, d_.data() + q, n - q);
  dependent_ = !(d2_squared_ > kDependent * kDependent * dot(d_.data(), d_.data(), n));

  std::fill_n(z_.data(), n, 0.0);
  for (int k = q; k < n; ++k) axpy(d_(k), j_.data() + k * n, z_.data(), n);

  std::copy_n(d_.data(), q, dual_.data());
  solve_r(dual_.data());
}

// t1 = min of multiplier_k / r_k over r_k > 0, and its k; infinity if there is none.
DenseSolver::DualStep DenseSolver::longest_dual_step() const noexcept {
  double least = 0.0;
  if (dependent_) {  // there is no t2: a rounding error in r must not pass for a t1
    least = 1.0;
    for (int k = 0; k < active_count_; ++k) least = std::max(least, std::abs(dual_(k)));
    least *= kNegligible;
  }
  DualStep step{kInfinity, -1};
  for (int k = 0; k < active_count_; ++k) {
    if (dual_(k) > least && multiplier_[k] < step.length * dual_(k)) {
      step = {std::max(multiplier_[k], 0.0) / dual_(k), k};
    }
  }
  return step;
}

// Farkas: with y = 1 for the entering row and -r for the active rows,
//   every u in the box has  y' (G u - limit) >= margin, and so violates a row by margin / sum y.
// True whatever the rounding errors in y.
double DenseSolver::least_violation(const QpProblem& problem) const noexcept {
  double sum[kMaxInputs] = {};  // G' y
  double margin = 0.0;
  double weight = 0.0;
  const auto take = [&](Constraint c, double y) {
    if (c.index < n_ || !(y > 0.0)) return;
    add_normal(problem, c, y, sum);
    margin -= y * offsets_(c.index - n_);
    weight += y;
  };
  take(entering_, 1.0);
  for (int k = 0; k < active_count_; ++k) take(active_[k], -dual_(k));
  for (int j = 0; j < n_; ++j) {
    margin += std::min(sum[j] * problem.lower(j), sum[j] * problem.upper(j));
  }
  return weight > 0.0 ? margin / weight : -kInfinity;
}

// Raises the limits of the rows in conflict, so that they just have a point in common; and by what
// counts as violated, or rounding may bring the conflict back.
void DenseSolver::relax(const QpProblem& problem, double gap) noexcept {
  const auto raise = [&](int index) {
    offsets_(index - n_) += std::max(gap, least_counted(problem, index));
  };
  if (entering_.index >= n_) raise(entering_.index);
  for (int k = 0; k < active_count_; ++k) {
    if (active_[k].index >= n_ && dual_(k) < 0.0) raise(active_[k].index);
  }
}

// A reflection of the columns of J2 that maps d2 to (delta, 0, …); it needs J2 d2, which is z.
void DenseSolver::add_entering() noexcept {
  const int n = n_;
  const int q = active_count_;
  const double delta = d_(q) > 0.0 ? -std::sqrt(d2_squared_) : std::sqrt(d2_squared_);
  axpy(-delta, j_.data() + q * n, z_.data(), n);
  const double beta = 1.0 / (delta * (delta - d_(q)));
  d_(q) -= delta;
  for (int k = q; k < n; ++k) axpy(-beta * d_(k), z_.data(), j_.data() + k * n, n);
  d_(q) = delta;
  std::copy_n(d_.data(), q + 1, r_.data() + q * n);
  active_[q] = entering_;
  multiplier_[q] = entering_multiplier_;
  is_active_[entering_.index] = true;
  ++active_count_;
}

// Removes a column of R and makes R triangular again by rotations of its rows and the columns of J.
void DenseSolver::drop(int position) noexcept {
  const int n = n_;
  is_active_[active_[position].index] = false;
  --active_count_;
  for (int k = position; k < active_count_; ++k) {
    active_[k] = active_[k + 1];
    multiplier_[k] = multiplier_[k + 1];
    std::copy_n(r_.data() + (k + 1) * n, k + 2, r_.data() + k * n);
  }
  for (int k = position; k < active_count_; ++k) {
    const double length = std::hypot(r_(k, k), r_(k + 1, k));
    const double c = r_(k, k) / length;
    const double s = r_(k + 1, k) / length;
    const auto rotate = [c, s](double& a, double& b) {
      const double old = a;
      a = c * a + s * b;
      b = c * b - s * old;
    };
    for (int i = k; i < active_count_; ++i) rotate(r_(k, i), r_(k + 1, i));
    for (int i = 0; i < n; ++i) rotate(j_(i, k), j_(i, k + 1));
  }
}

// One step of iterative refinement of (u, multipliers) for the active set N' u = b:
//   H du + N dm = e1 = -(H u + g + N m),  N' du = e2 = b - N' u;  with du = J y:
//   R' y1 = e2,  y2 = (J' e1)_2,  R dm = (J' e1)_1 - y1.
void DenseSolver::refine(const QpProblem& problem) noexcept {
  const int n = n_;
  const int q = active_count_;
  double* e1 = z_.data();
  for (int j = 0; j < n; ++j) e1[j] = -problem.gradient(j);
  for (int j = 0; j < n; ++j) axpy(-u_(j), problem.hessian.data() + j * n, e1, n);
  for (int k = 0; k < q; ++k) add_normal(problem, active_[k], -multiplier_[k], e1);
  for (int k = 0; k < q; ++k) {
    const double e2 = -violation(problem, active_[k]);
    d_(k) = (e2 - dot(r_.data() + k * n, d_.data(), k)) / r_(k, k);
    dual_(k) = dot(j_.data() + k * n, e1, n) - d_(k);
  }
  for (int k = q; k < n; ++k) d_(k) = dot(j_.data() + k * n, e1, n);
  for (int k = 0; k < n; ++k) axpy(d_(k), j_.data() + k * n, u_.data(), n);
  solve_r(dual_.data());
  axpy(1.0, dual_.data(), multiplier_, q);
}

// x = R^-1 x.
void DenseSolver::solve_r(double* x) const noexcept {
  for (int k = active_count_ - 1; k >= 0; --k) {
    x[k] /= r_(k, k);
    axpy(-x[k], r_.data() + k * n_, x, k);
  }
}

void DenseSolver::add_normal(const QpProblem& problem, Constraint c, double factor,
                             double* target) const noexcept {
  if (c.index < n_) {
    target[c.index] += factor * c.sign;
  } else {
    const int i = c.index - n_;
    const double scaled = factor * row_weights_(i);
    for (int j = 0; j < n_; ++j) target[j] += scaled * problem.rows(i, j);
  }
}

// Writes u and the multipliers, and checks the KKT conditions on what was written.
QpStatus DenseSolver::conclude(const QpProblem& problem, QpSolution& solution) const noexcept {
  const int n = n_;
  solution.power.resize(n);
  solution.bound_multiplier.setZero(n);
  solution.row_multiplier.setZero(problem.rows.rows());
  double* u = solution.power.data();
  for (int j = 0; j < n; ++j) u[j] = std::clamp(u_(j), problem.lower(j), problem.upper(j));
  for (int k = 0; k < active_count_; ++k) {
    const auto [index, sign] = active_[k];
    const double multiplier = std::max(multiplier_[k], 0.0);  // more than rounding shows below
    if (index < n) {
      u[index] = sign > 0.0 ? problem.upper(index) : problem.lower(index);
      solution.bound_multiplier(index) = sign * multiplier;
    } else {
      solution.row_multiplier(index - n) = multiplier * row_weights_(index - n);
    }
  }
  const KktResidual kkt = evaluate_kkt(problem, solution);
  solution.kkt_residual = kkt.largest();
  return is_optimal(kkt) ? QpStatus::kSolved : QpStatus::kKktFailed;
}

}  // namespace photocoag
