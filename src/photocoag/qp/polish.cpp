#include "photocoag/qp/polish.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/qp/kkt.hpp"
#include "photocoag/qp/tolerances.hpp"

namespace photocoag {
namespace {

constexpr double kRegularization = 1e-10;  // of the Schur complement, whose diagonal is 1
constexpr int kRounds = 10;                // of correcting the active set
constexpr int kSteps = 6;  // of refinement, which removes the effect of the regularization
constexpr double kRoundedMultiplier = 1e-10;  // a multiplier over the objective's terms: rounding

// L of A = L L', in place in the lower triangle of n columns of length `stride`.
bool cholesky(double* a, int n, int stride) noexcept {
  for (int k = 0; k < n; ++k) {
    double* column = a + k * stride;
    const double diagonal = column[k];
    for (int j = 0; j < k; ++j) {
      const double* left = a + j * stride;
      for (int i = k; i < n; ++i) column[i] -= left[k] * left[i];
    }
    if (!(column[k] > kPivot * diagonal)) return false;
    const double root = std::sqrt(column[k]);
    for (int i = k; i < n; ++i) column[i] /= root;
  }
  return true;
}

void solve_lower(const double* l, int n, int stride, double* x) noexcept {
  for (int k = 0; k < n; ++k) {
    x[k] /= l[k * stride + k];
    for (int i = k + 1; i < n; ++i) x[i] -= l[k * stride + i] * x[k];
  }
}

void solve_upper(const double* l, int n, int stride, double* x) noexcept {
  for (int k = n - 1; k >= 0; --k) {
    for (int i = k + 1; i < n; ++i) x[k] -= l[k * stride + i] * x[i];
    x[k] /= l[k * stride + k];
  }
}

}  // namespace

bool Polisher::polish(const QpProblem& problem, QpSolution& solution) noexcept {
  n_ = static_cast<int>(problem.hessian.rows());
  find_active(problem, solution);
  std::copy_n(solution.power.data(), n_, u_);
  if (!factorize_hessian(problem)) return false;
  for (int round = 0; round < kRounds; ++round) {
    if (!factorize_active(problem)) return false;
    for (int step = 0; step < kSteps; ++step) improve(problem);
    write(problem, solution);
    const KktResidual kkt = evaluate_kkt(problem, solution);
    solution.kkt_residual = kkt.largest();
    if (is_optimal(kkt)) return true;
    if (!correct(problem)) return false;
  }
  return false;
}

void Polisher::write(const QpProblem& problem, QpSolution& solution) const noexcept {
  solution.bound_multiplier.setZero();
  solution.row_multiplier.setZero();
  for (int j = 0; j < n_; ++j) {
    solution.power(j) = std::clamp(u_[j], problem.lower(j), problem.upper(j));
  }
  for (int a = 0; a < count_; ++a) {
    const auto [index, sign, fixed, scale, value] = active_[a];
    const double force = (fixed ? multiplier_[a] : std::max(multiplier_[a], 0.0)) * scale;
    if (index >= n_) {
      solution.row_multiplier(index - n_) = force;
    } else {
      solution.power(index) = sign > 0.0 ? problem.upper(index) : problem.lower(index);
      solution.bound_multiplier(index) = sign * force;
    }
  }
}

// Drops constraints with a multiplier of the wrong sign, adds violated ones. False if the set
// stays.
bool Polisher::correct(const QpProblem& problem) noexcept {
  const int m = static_cast<int>(problem.rows.rows());
  bool is_active[kMostActive] = {};
  int kept = 0;
  for (int a = 0; a < count_; ++a) {
    is_active[active_[a].index] = true;
    if (!(multiplier_[a] > 0.0) && !active_[a].fixed) continue;
    active_[kept] = active_[a];
    multiplier_[kept++] = multiplier_[a];
  }
  bool changed = kept < count_;
  count_ = kept;
  for (int c = 0; c < n_ + m; ++c) {
    if (is_active[c]) continue;
    double scale = 0.0;
    double excess = 0.0;
    double sign = 1.0;
    if (c < n_) {
      scale = std::max(std::abs(problem.lower(c)), std::abs(problem.upper(c)));
      sign = u_[c] > problem.upper(c) ? 1.0 : -1.0;
      excess = std::max(u_[c] - problem.upper(c), problem.lower(c) - u_[c]);
    } else {
      excess = -problem.limit(c - n_);
      scale = std::abs(excess);
      for (int j = 0; j < n_; ++j) {
        excess += problem.rows(c - n_, j) * u_[j];
        scale += std::abs(problem.rows(c - n_, j) * u_[j]);
      }
    }
    if (!(excess > kViolated * scale)) continue;
    take(problem, c, sign, 0.0);
    changed = true;
  }
  return changed;
}

void Polisher::take(const QpProblem& problem, int index, double sign, double multiplier) noexcept {
  const double limit = index >= n_  ? problem.limit(index - n_)
                       : sign > 0.0 ? problem.upper(index)
                                    : -problem.lower(index);
  const bool fixed = index < n_ && problem.lower(index) == problem.upper(index);
  active_[count_] = {.index = index, .sign = sign, .fixed = fixed, .scale = 1.0, .value = limit};
  multiplier_[count_++] = multiplier;
}

void Polisher::find_active(const QpProblem& problem, const QpSolution& solution) noexcept {
  const int m = static_cast<int>(problem.rows.rows());
  double energy = 0.0;       // largest of the objective's derivatives in the box, times the box
  double size[kMostActive];  // multiplier times what its constraint measures in the box
  for (int c = 0; c < n_ + m; ++c) {
    if (c < n_) {
      const double box = std::max(std::abs(problem.lower(c)), std::abs(problem.upper(c)));
      size[c] = std::abs(solution.bound_multiplier(c)) * box;
      double slope = std::abs(problem.gradient(c));
      for (int j = 0; j < n_; ++j) {
        slope += std::abs(problem.hessian(j, c)) *
                 std::max(std::abs(problem.lower(j)), std::abs(problem.upper(j)));
      }
      energy = std::max(energy, slope * box);
    } else {
      double scale = std::abs(problem.limit(c - n_));
      double reach = 0.0;
      for (int j = 0; j < n_; ++j) {
        const double box = std::max(std::abs(problem.lower(j)), std::abs(problem.upper(j)));
        reach += std::abs(problem.rows(c - n_, j)) * box;
      }
      scale = std::max(scale, reach);
      size[c] = scale < kInfinity ? std::abs(solution.row_multiplier(c - n_)) * scale : 0.0;
    }
  }
  count_ = 0;
  for (int c = 0; c < n_ + m; ++c) {
    const bool fixed = c < n_ && problem.lower(c) == problem.upper(c);
    if (!(size[c] > kRoundedMultiplier * energy) && !fixed) continue;
    const double multiplier =
        c < n_ ? solution.bound_multiplier(c) : solution.row_multiplier(c - n_);
    const double sign = multiplier < 0.0 ? -1.0 : 1.0;
    take(problem, c, sign, sign * multiplier);
  }
}

double Polisher::normal(const QpProblem& problem, const Active& a, int j) const noexcept {
  if (a.index < n_) return j == a.index ? a.sign * a.scale : 0.0;
  return problem.rows(a.index - n_, j) * a.scale;
}

bool Polisher::factorize_hessian(const QpProblem& problem) noexcept {
  for (int k = 0; k < n_; ++k) {
    for (int i = k; i < n_; ++i) hessian_factor_[k * kStride + i] = problem.hessian(i, k);
  }
  return cholesky(hessian_factor_, n_, kStride);
}

// Scales the constraints to a H^-1 a' = 1.
bool Polisher::factorize_active(const QpProblem& problem) noexcept {
  int kept = 0;
  for (int c = 0; c < count_; ++c) {
    Active a = active_[c];
    double* column = reach_ + kept * kStride;
    for (int j = 0; j < n_; ++j) column[j] = normal(problem, a, j);
    solve_lower(hessian_factor_, n_, kStride, column);
    double norm = 0.0;
    for (int j = 0; j < n_; ++j) norm += column[j] * column[j];
    norm = std::sqrt(norm);
    if (!(norm > 0.0)) continue;  // a row of zeros constrains nothing
    for (int j = 0; j < n_; ++j) column[j] /= norm;
    a.scale /= norm;
    a.value /= norm;
    active_[kept] = a;
    multiplier_[kept++] = multiplier_[c] * norm;
  }
  count_ = kept;
  for (int a = 0; a < count_; ++a) {
    for (int b = a; b < count_; ++b) {
      double sum = a == b ? kRegularization : 0.0;
      for (int j = 0; j < n_; ++j) sum += reach_[a * kStride + j] * reach_[b * kStride + j];
      schur_factor_[a * kMostActive + b] = sum;
    }
  }
  return cholesky(schur_factor_, count_, kMostActive);
}

// One step of refinement of H u + g + A' y = 0, A u = b:
//   S dy = A H^-1 r1 - r2,  du = H^-1 (r1 - A' dy),  S = A H^-1 A' regularized.
void Polisher::improve(const QpProblem& problem) noexcept {
  double r1[even(kMaxInputs)];
  double dy[kMostActive];
  for (int j = 0; j < n_; ++j) r1[j] = -problem.gradient(j);
  for (int k = 0; k < n_; ++k) {
    for (int j = 0; j < n_; ++j) r1[j] -= problem.hessian(j, k) * u_[k];
  }
  for (int a = 0; a < count_; ++a) {
    for (int j = 0; j < n_; ++j) r1[j] -= normal(problem, active_[a], j) * multiplier_[a];
  }
  solve_lower(hessian_factor_, n_, kStride, r1);
  for (int a = 0; a < count_; ++a) {
    dy[a] = -active_[a].value;
    for (int j = 0; j < n_; ++j) {
      dy[a] += normal(problem, active_[a], j) * u_[j] + reach_[a * kStride + j] * r1[j];
    }
  }
  solve_lower(schur_factor_, count_, kMostActive, dy);
  solve_upper(schur_factor_, count_, kMostActive, dy);
  for (int a = 0; a < count_; ++a) {
    multiplier_[a] += dy[a];
    for (int j = 0; j < n_; ++j) r1[j] -= reach_[a * kStride + j] * dy[a];
  }
  solve_upper(hessian_factor_, n_, kStride, r1);
  for (int j = 0; j < n_; ++j) u_[j] += r1[j];
}

}  // namespace photocoag
