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
constexpr double kPivot = 1e-14;       // Cholesky pivot over the diagonal: below, H is not definite

// Plain loops, not Eigen's reductions: those start at an aligned address, so that the order of the
// sum, and its last bit, would depend on where the object lies.
double dot(const double* a, const double* b, int n) noexcept {
  double even = 0.0;
  double odd = 0.0;
  int i = 0;
  for (; i + 1 < n; i += 2) {
    even += a[i] * b[i];
    odd += a[i + 1] * b[i + 1];
  }
  return i < n ? even + odd + a[i] * b[i] : even + odd;
}

void axpy(double s, const double* __restrict x, double* __restrict y, int n) noexcept {
  for (int i = 0; i < n; ++i) y[i] += s * x[i];
}

}  // namespace

QpStatus DenseSolver::solve(const QpProblem& problem, QpSolution& solution) noexcept {
  const int n = static_cast<int>(problem.hessian.rows());
  const int m = static_cast<int>(problem.rows.rows());
  iterations_ = 0;

  QpStatus status = examine(problem);
  if (status == QpStatus::kSolved) status = prepare(problem);
  if (status == QpStatus::kSolved) {
    status = iterate(problem, std::min(iteration_limit_, iteration_bound(n, m)));
  }
  if (status == QpStatus::kSolved) status = conclude(problem, solution);
  if (status != QpStatus::kSolved) give_up(problem, solution);
  solution.iterations = iterations_;
  solution.status = status;
  return status;
}

// Scales the box, and normalizes the rows that some u in the box violates.
QpStatus DenseSolver::prepare(const QpProblem& problem) noexcept {
  const int n = n_ = static_cast<int>(problem.hessian.rows());
  const int m = static_cast<int>(problem.rows.rows());
  box_scale_.resize(n);
  d_.setZero(m);  // largest G_i u in the box
  z_.setZero(m);  // sum_j |G_ij| max(|lower_j|, |upper_j|)
  for (int j = 0; j < n; ++j) {
    const double lower = problem.lower(j);
    const double upper = problem.upper(j);
    const double scale = std::max(std::abs(lower), std::abs(upper));
    box_scale_(j) = scale > 0.0 ? scale : 1.0;
    const double* column = problem.rows.data() + j * m;
    for (int i = 0; i < m; ++i) {
      d_(i) += std::max(column[i] * lower, column[i] * upper);
      z_(i) += std::abs(column[i]) * scale;
    }
  }

  normals_.resize(n, m);
  offsets_.resize(m);
  row_scales_.resize(m);
  double known = 0.0;
  for (int i = 0; i < m; ++i) known = std::max(known, std::min(std::abs(problem.limit(i)), z_(i)));
  int count = 0;
  for (int i = 0; i < m; ++i) {
    const double least = without_reach(z_(i), problem.limit(i)) ? -kLimitRounding * known : d_(i);
    if (problem.limit(i) >= std::min(least, d_(i))) continue;
    const double scale = std::max(std::abs(problem.limit(i)), z_(i));
    if (!(scale < kInfinity)) return QpStatus::kNumericalFailure;
    for (int j = 0; j < n; ++j) normals_(j, count) = problem.rows(i, j) / scale;
    offsets_(count) = problem.limit(i) / scale;
    row_scales_(count) = scale;
    row_of_[count++] = i;
  }
  offsets_.conservativeResize(count);
  std::fill_n(is_active_, n + count, false);
  return factorize(problem.hessian) ? QpStatus::kSolved : QpStatus::kNumericalFailure;
}

// H = L L' (in r_), J = L^-T.
bool DenseSolver::factorize(const InputMatrix& hessian) noexcept {
  const int n = n_;
  r_ = hessian;
  for (int k = 0; k < n; ++k) {
    double* column = r_.data() + k * n;
    if (!(column[k] > kPivot * hessian(k, k))) return false;
    column[k] = std::sqrt(column[k]);
    const double inverse = 1.0 / column[k];
    for (int i = k + 1; i < n; ++i) column[i] *= inverse;
    for (int j = k + 1; j < n; ++j) axpy(-column[j], column + j, r_.data() + j * n + j, n - j);
  }
  j_.setZero(n, n);
  for (int k = 0; k < n; ++k) {
    double* column = j_.data() + k * n;
    column[k] = 1.0 / r_(k, k);
    for (int i = k - 1; i >= 0; --i) {
      column[i] = -dot(r_.data() + i * n + i + 1, column + i + 1, k - i) / r_(i, i);
    }
  }
  return true;
}

// The algorithm of Goldfarb and Idnani. kSolved: nothing is violated; optimality is unchecked.
QpStatus DenseSolver::iterate(const QpProblem& problem, int limit) noexcept {
  const int n = n_;
  // Step 0: the unconstrained minimum u = -J J' g.
  active_count_ = 0;
  u_.setZero(n);
  d_.resize(n);
  z_.resize(n);
  dual_.resize(n);
  for (int k = 0; k < n; ++k) {
    const double* column = j_.data() + k * n;
    axpy(-dot(column, problem.gradient.data(), k + 1), column, u_.data(), k + 1);
  }

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
  const double* normal = normals_.data() + (index - n) * n;
  double sum = kWide * std::abs(offsets_(index - n));
  for (int j = 0; j < n; ++j) sum += std::abs(normal[j]) * size(j);
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
    const double scaled = std::max(above, below) / box_scale_(j);
    if (scaled > largest && (scaled > kViolated || scaled > least_counted(problem, j))) {
      largest = scaled;
      entering_ = {j, above > below ? 1.0 : -1.0};
    }
  }
  for (int i = 0; i < static_cast<int>(offsets_.size()); ++i) {
    if (is_active_[n + i]) continue;
    const double scaled = dot(normals_.data() + i * n, u_.data(), n) - offsets_(i);
    if (scaled > largest && (scaled > kViolated || scaled > least_counted(problem, n + i))) {
      largest = scaled;
      entering_ = {n + i, 1.0};
    }
  }
  return largest > 0.0;
}

// n' u - b.
double DenseSolver::violation(const QpProblem& problem, Constraint c) const noexcept {
  if (c.index >= n_) {
    const int i = c.index - n_;
    return dot(normals_.data() + i * n_, u_.data(), n_) - offsets_(i);
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
    const double* normal = normals_.data() + (entering_.index - n) * n;
    for (int k = 0; k < n; ++k) d_(k) = dot(j_.data() + k * n, normal, n);
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
    add_normal(c, y, sum);
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
  for (int k = 0; k < q; ++k) add_normal(active_[k], -multiplier_[k], e1);
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

void DenseSolver::add_normal(Constraint c, double factor, double* target) const noexcept {
  if (c.index < n_) {
    target[c.index] += factor * c.sign;
  } else {
    axpy(factor, normals_.data() + (c.index - n_) * n_, target, n_);
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
      solution.row_multiplier(row_of_[index - n]) = multiplier / row_scales_(index - n);
    }
  }
  const KktResidual kkt = evaluate_kkt(problem, solution);
  solution.kkt_residual = kkt.largest();
  return is_optimal(kkt) ? QpStatus::kSolved : QpStatus::kKktFailed;
}

}  // namespace photocoag
