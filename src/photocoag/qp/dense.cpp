#include "photocoag/qp/dense.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/fixed_length.hpp"
#include "photocoag/qp/kkt.hpp"
#include "photocoag/qp/single.hpp"
#include "photocoag/qp/sums.hpp"
#include "photocoag/qp/tolerances.hpp"

namespace photocoag {
namespace {

// All relative. Rounding in n' u is some 1e-15 of the row's scale for 49 inputs.
constexpr double kWide = 10.0;         // a box counts as at most this many times larger than u
constexpr double kNegligible = 1e-12;  // components of r that may be rounding errors

// Leading zeros of a column, in multiples of four: rows of a plan do not depend on later inputs.
int leading_zeros(const double* column, int m) noexcept {
  int i = 0;
  for (; i + 3 < m; i += 4) {
    double sum[2] = {std::abs(column[i]), std::abs(column[i + 1])};
    sum[0] += std::abs(column[i + 2]);
    sum[1] += std::abs(column[i + 3]);
    if (sum[0] + sum[1] != 0.0) break;
  }
  return i;
}

}  // namespace

QpStatus DenseSolver::solve(const QpProblem& problem, QpSolution& solution) noexcept {
  iterations_ = 0;
  bool definite = false;
  if (sizes_match(problem)) {
    if (problem.hessian.rows() == 1 && problem.limit.size() == 1) {
      if (solve_single(problem, iteration_limit_ > 0, solution)) return QpStatus::kSolved;
    }
    u_.resize(problem.hessian.rows());
    definite = factor_.minimize(problem.hessian, problem.gradient, u_.data());
    // In most problems nothing binds. The check reads all data, so bad data fail it.
    if (definite && take_inner(problem, solution)) return QpStatus::kSolved;
  }
  QpStatus status = examine(problem);
  if (status == QpStatus::kSolved) status = prepare(problem);
  if (status == QpStatus::kSolved && !definite) status = QpStatus::kNumericalFailure;
  if (status == QpStatus::kSolved) {
    const int bound = iteration_bound(n_, static_cast<int>(offsets_.size()));
    status = iterate(problem, std::min(iteration_limit_, bound), solution);
  }
  if (status != QpStatus::kSolved) give_up(problem, solution);
  solution.iterations = iterations_;
  solution.status = status;
  return status;
}

// Takes the unconstrained minimizer if it is feasible.
bool DenseSolver::take_inner(const QpProblem& problem, QpSolution& solution) const noexcept {
  const double residual = inner_residual(problem, u_.data());
  if (!(residual <= kSharp)) return false;
  write_inner(problem, u_.data(), residual, solution);
  return true;
}

// Scales the box and the rows. A row that no u in the box violates is skipped: its offset is
// infinite.
QpStatus DenseSolver::prepare(const QpProblem& problem) noexcept {
  n_ = static_cast<int>(problem.hessian.rows());
  const int m = static_cast<int>(problem.rows.rows());
  if (m != n_) return prepare_as(problem, n_, m);
  return for_length<2, 3, 4, 9>(n_, [&](auto size) { return prepare_as(problem, size, size); });
}

template <typename Inputs, typename Rows>
QpStatus DenseSolver::prepare_as(const QpProblem& problem, Inputs inputs, Rows rows) noexcept {
  const int n = inputs;
  const int m = rows;
  box_scale_.resize(n);
  box_weight_.resize(n);
  double most[even(kMaxInputs)];   // largest G_i u in the box
  double reach[even(kMaxInputs)];  // sum_j |G_ij| max(|lower_j|, |upper_j|)
  for (int i = 0; i < m; ++i) most[i] = reach[i] = 0.0;
  for (int j = 0; j < n; ++j) {
    const double lower = problem.lower(j);
    const double upper = problem.upper(j);
    const double scale = std::max(std::abs(lower), std::abs(upper));
    box_scale_(j) = scale > 0.0 ? scale : 1.0;
    box_weight_(j) = 1.0 / box_scale_(j);
    const double* column = problem.rows.data() + j * m;
    // With a compile-time length zeros are not skipped.
    const int first = first_[j] = std::is_same_v<Rows, int> ? leading_zeros(column, m) : 0;
    for (int i = first; i < m; ++i) {
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
  return QpStatus::kSolved;
}

// The algorithm of Goldfarb and Idnani. kSolved: `solution` holds a verified answer.
QpStatus DenseSolver::iterate(const QpProblem& problem, int limit, QpSolution& solution) noexcept {
  const int n = n_;
  // Step 0: u is the unconstrained minimum.
  factor_.prepare_solutions();
  normals_.clear(n);
  relaxed_ = false;

  bool entering = false;
  for (iterations_ = 0; iterations_ <= limit; ++iterations_) {
    // Step 1: choose a violated constraint; if there is none and u is not accurate enough, refine
    // and check again.
    if (!entering) {
      if (!choose_violated(problem)) {
        if (conclude(problem, kSharp, solution)) return QpStatus::kSolved;
        if (relaxed_) {  // the active set is found: remove the margin
          for (int i = 0; i < offsets_.size(); ++i) offsets_(i) -= margin_[i];
          refine(problem);
          if (!choose_violated(problem) && conclude(problem, kInfinity, solution)) {
            return QpStatus::kSolved;
          }
          for (int i = 0; i < offsets_.size(); ++i) offsets_(i) += margin_[i];
        }
        refine(problem);
        if (!choose_violated(problem)) {
          return conclude(problem, kInfinity, solution) ? QpStatus::kSolved : QpStatus::kKktFailed;
        }
      }
      entering = true;
      entering_multiplier_ = 0.0;
    }
    if (iterations_ == limit) break;

    // Step 2a: the step direction in primal and dual space.
    evaluate_directions(problem);

    // Step 2b: the step length. t1 keeps the multipliers positive, t2 ends the violation.
    const auto [t1, leaving] = longest_dual_step();
    const bool dependent = normals_.dependent();
    const double t2 = dependent ? kInfinity : violation(problem, entering_) / normals_.slope();
    const double t = std::min(t1, t2);

    // Step 2c: no step, a step in dual space, or a step in both.
    if (t == kInfinity) {
      const double gap = least_violation(problem);
      if (gap > kFeasible) return QpStatus::kInfeasible;
      // Contradicts the proof, or the entering constraint would leave again: only by rounding.
      if (!(gap >= -kFeasible) || entering_multiplier_ > 0.0) return QpStatus::kNumericalFailure;
      relax(problem, gap);
      refine(problem);
      entering = false;
      continue;
    }
    if (!dependent) axpy(-t, normals_.primal(), u_.data(), n);
    axpy(-t, normals_.dual(), multiplier_, normals_.count());
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

// kViolated, or less where the box is far wider than u, relative to what rounds there.
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

// Violation of every inactive constraint; returns the largest and its index.
template <typename Inputs, typename Rows>
DenseSolver::Worst DenseSolver::worst(const QpProblem& problem, Inputs inputs, Rows rows,
                                      double* __restrict excess) const noexcept {
  const int n = inputs;
  const int m = rows;
  const double* __restrict u = u_.data();
  const double* __restrict lower = problem.lower.data();
  const double* __restrict upper = problem.upper.data();
  const double* __restrict weight = box_weight_.data();
  for (int j = 0; j < n; ++j) {
    excess[j] = std::max(u[j] - upper[j], lower[j] - u[j]) * weight[j];
  }
  double* __restrict value = excess + n;  // G u
  for (int i = 0; i < m; ++i) value[i] = 0.0;
  for (int j = 0; j < n; ++j) {
    const double* __restrict column = problem.rows.data() + j * m;
    for (int i = std::is_same_v<Rows, int> ? first_[j] : 0; i < m; ++i)
      value[i] += column[i] * u[j];
  }
  for (int i = 0; i < m; ++i) value[i] = value[i] * row_weights_.data()[i] - offsets_.data()[i];
  for (int k = 0; k < normals_.count(); ++k) excess[active_[k].index] = -kInfinity;
  Worst out{0, 0.0};
  for (int c = 0; c < n + m; ++c) {
    if (excess[c] > out.excess) out = {c, excess[c]};
  }
  return out;
}

// The constraint with the largest violation relative to its scale; false if there is none.
bool DenseSolver::choose_violated(const QpProblem& problem) noexcept {
  const int m = static_cast<int>(offsets_.size());
  double excess[2 * even(kMaxInputs)];  // over the scale, bounds before rows
  const auto [at, largest] =
      m == n_ ? for_length<2, 3, 4, 9>(
                    n_, [&](auto size) { return worst(problem, size, size, excess); })
              : worst(problem, n_, m, excess);
  int chosen = at;
  if (!(largest > kViolated)) {  // by rounding, or nothing
    double most = 0.0;
    for (int c = 0; largest > 0.0 && c < n_ + m; ++c) {
      if (excess[c] > most && excess[c] > least_counted(problem, c)) {
        most = excess[c];
        chosen = c;
      }
    }
    if (!(most > 0.0)) return false;
  }
  const bool upper = chosen >= n_ || u_(chosen) > problem.upper(chosen);
  entering_ = {chosen, upper ? 1.0 : -1.0};
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

void DenseSolver::evaluate_directions(const QpProblem& problem) noexcept {
  const int row = entering_.index - n_;
  normals_.direct(factor_, row < 0 ? Normal{.index = entering_.index, .scale = entering_.sign}
                                   : Normal{.row = problem.rows.data() + row,
                                            .stride = static_cast<int>(offsets_.size()),
                                            .scale = row_weights_(row)});
}

// t1 = min of multiplier_k / r_k over r_k > 0, and its k; infinity if there is none.
DenseSolver::DualStep DenseSolver::longest_dual_step() const noexcept {
  const double* dual = normals_.dual();
  double least = 0.0;
  if (normals_
          .dependent()) {  // there is no t2: a rounding error in r must not be mistaken for a t1
    least = 1.0;
    for (int k = 0; k < normals_.count(); ++k) least = std::max(least, std::abs(dual[k]));
    least *= kNegligible;
  }
  DualStep step{kInfinity, -1};
  for (int k = 0; k < normals_.count(); ++k) {
    if (dual[k] > least && multiplier_[k] < step.length * dual[k]) {
      step = {std::max(multiplier_[k], 0.0) / dual[k], k};
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
  for (int k = 0; k < normals_.count(); ++k) take(active_[k], -normals_.dual()[k]);
  for (int j = 0; j < n_; ++j) {
    margin += std::min(sum[j] * problem.lower(j), sum[j] * problem.upper(j));
  }
  return weight > 0.0 ? margin / weight : -kInfinity;
}

// Raises the limits of the conflicting rows until they have a common point, plus a margin against
// rounding.
void DenseSolver::relax(const QpProblem& problem, double gap) noexcept {
  if (!relaxed_) std::fill_n(margin_, offsets_.size(), 0.0);
  relaxed_ = true;
  const auto raise = [&](int index) {
    const double by = std::max(gap, least_counted(problem, index));
    offsets_(index - n_) += by;
    margin_[index - n_] += by - std::max(gap, 0.0);
  };
  if (entering_.index >= n_) raise(entering_.index);
  for (int k = 0; k < normals_.count(); ++k) {
    if (active_[k].index >= n_ && normals_.dual()[k] < 0.0) raise(active_[k].index);
  }
}

void DenseSolver::add_entering() noexcept {
  const int q = normals_.count();
  normals_.add();
  active_[q] = entering_;
  multiplier_[q] = entering_multiplier_;
}

void DenseSolver::drop(int position) noexcept {
  normals_.drop(position);
  for (int k = position; k < normals_.count(); ++k) {
    active_[k] = active_[k + 1];
    multiplier_[k] = multiplier_[k + 1];
  }
}

// One step of iterative refinement of u and the multipliers for the active set.
void DenseSolver::refine(const QpProblem& problem) noexcept {
  const int n = n_;
  const int q = normals_.count();
  double e1[even(kMaxInputs)];
  double e2[even(kMaxInputs)];
  for (int j = 0; j < n; ++j) e1[j] = -problem.gradient(j);
  for (int j = 0; j < n; ++j) axpy(-u_(j), problem.hessian.data() + j * n, e1, n);
  for (int k = 0; k < q; ++k) {
    add_normal(problem, active_[k], -multiplier_[k], e1);
    e2[k] = -violation(problem, active_[k]);
  }
  normals_.correct(factor_, e1, e2);
  axpy(1.0, e1, u_.data(), n);
  axpy(1.0, e2, multiplier_, q);
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

// Writes u and the multipliers, and checks the KKT conditions on what was written: true if they
// hold, and to `largest`.
bool DenseSolver::conclude(const QpProblem& problem, double largest,
                           QpSolution& solution) const noexcept {
  const int n = n_;
  solution.power.resize(n);
  solution.bound_multiplier.setZero(n);
  solution.row_multiplier.setZero(problem.rows.rows());
  double* u = solution.power.data();
  for (int j = 0; j < n; ++j) u[j] = std::clamp(u_(j), problem.lower(j), problem.upper(j));
  for (int k = 0; k < normals_.count(); ++k) {
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
  return is_optimal(kkt) && solution.kkt_residual <= largest;
}

}  // namespace photocoag
