#include "photocoag/benchmark/qp_reference.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

using Real = long double;
using Vector = LongVector;
using Matrix = LongMatrix;

struct ActiveSet {
  std::vector<int> free;  // inputs between their bounds
  std::vector<int> rows;  // rows that hold with equality
  Vector fixed;           // u with 0 for the free inputs
};

ActiveSet active_set(const QpProblem& problem, const QpSolution& guess) {
  const int n = static_cast<int>(problem.hessian.rows());
  ActiveSet set{.free = {}, .rows = {}, .fixed = Vector::Zero(n)};
  for (int j = 0; j < n; ++j) {
    const double multiplier = guess.bound_multiplier(j);
    if (multiplier > 0.0 || problem.lower(j) == problem.upper(j)) {
      set.fixed(j) = problem.upper(j);
    } else if (multiplier < 0.0) {
      set.fixed(j) = problem.lower(j);
    } else {
      set.free.push_back(j);
    }
  }
  for (int i = 0; i < problem.rows.rows(); ++i) {
    if (guess.row_multiplier(i) > 0.0) set.rows.push_back(i);
  }
  return set;
}

Real row_scale(const QpProblem& problem, int i) {
  Real scale = 0.0L;
  for (int j = 0; j < problem.rows.cols(); ++j) {
    scale += std::abs(Real(problem.rows(i, j))) *
             std::max(std::abs(Real(problem.lower(j))), std::abs(Real(problem.upper(j))));
  }
  scale = std::max(scale, std::abs(Real(problem.limit(i))));
  return scale > 0.0L ? scale : 1.0L;
}

// Largest violation of a KKT condition, relative to its terms.
Real violation(const QpProblem& problem, const ActiveSet& set, const Vector& u,
               const Vector& row_multiplier) {
  const int n = static_cast<int>(u.size());
  Real worst = 0.0L;
  std::vector<bool> is_free(n, false);
  for (const int j : set.free) is_free[j] = true;
  Vector force(n);
  Vector size(n);
  Real largest = 0.0L;
  for (int j = 0; j < n; ++j) {
    force(j) = problem.gradient(j);
    size(j) = std::abs(force(j));
    for (int k = 0; k < n; ++k) {
      const Real term = Real(problem.hessian(j, k)) * u(k);
      force(j) += term;
      size(j) += std::abs(term);
    }
    for (std::size_t a = 0; a < set.rows.size(); ++a) {
      const Real term = Real(problem.rows(set.rows[a], j)) * row_multiplier(Eigen::Index(a));
      force(j) += term;
      size(j) += std::abs(term);
    }
    largest = std::max(largest, size(j));
  }
  if (largest == 0.0L) largest = 1.0L;
  for (int j = 0; j < n; ++j) {
    const Real box = std::max(std::abs(Real(problem.lower(j))), std::abs(Real(problem.upper(j))));
    const Real outside = std::max(problem.lower(j) - u(j), u(j) - problem.upper(j));
    if (outside > 0.0L) worst = std::max(worst, box > 0.0L ? outside / box : outside);
    if (problem.lower(j) == problem.upper(j)) continue;  // its multiplier may have either sign
    if (is_free[j]) {
      worst = std::max(worst, std::abs(force(j)) / largest);
    } else {  // at the lower bound the force must push down the box: force >= 0
      worst = std::max(worst, (u(j) == problem.upper(j) ? force(j) : -force(j)) / largest);
    }
  }
  for (int i = 0; i < problem.rows.rows(); ++i) {
    if (!std::isfinite(problem.limit(i))) continue;
    Real excess = -Real(problem.limit(i));
    for (int j = 0; j < n; ++j) excess += Real(problem.rows(i, j)) * u(j);
    worst = std::max(worst, excess / row_scale(problem, i));
  }
  for (std::size_t a = 0; a < set.rows.size(); ++a) {
    const Real l = row_multiplier(Eigen::Index(a)) * row_scale(problem, set.rows[a]);
    worst = std::max(worst, -l / largest);
  }
  return worst;
}

}  // namespace

std::optional<QpReference> reference_minimizer(const QpProblem& problem, const QpSolution& guess,
                                               long double tolerance) {
  if (examine(problem) != QpStatus::kSolved || guess.status != QpStatus::kSolved) return {};
  const ActiveSet set = active_set(problem, guess);
  const int f = static_cast<int>(set.free.size());
  const int q = static_cast<int>(set.rows.size());
  // [H N'; N 0] (u, l) = (-g - H u_fixed, limit - G u_fixed), rows and columns of N scaled to 1.
  const Real unit = problem.hessian.diagonal().maxCoeff();
  Matrix kkt = Matrix::Zero(f + q, f + q);
  Vector right = Vector::Zero(f + q);
  for (int r = 0; r < f; ++r) {
    right(r) = -Real(problem.gradient(set.free[r])) / unit;
    for (int j = 0; j < set.fixed.size(); ++j) {
      right(r) -= Real(problem.hessian(set.free[r], j)) / unit * set.fixed(j);
    }
    for (int c = 0; c < f; ++c) kkt(r, c) = Real(problem.hessian(set.free[r], set.free[c])) / unit;
  }
  for (int a = 0; a < q; ++a) {
    const int i = set.rows[a];
    const Real scale = row_scale(problem, i);
    right(f + a) = problem.limit(i) / scale;
    for (int j = 0; j < set.fixed.size(); ++j) {
      right(f + a) -= Real(problem.rows(i, j)) / scale * set.fixed(j);
    }
    for (int c = 0; c < f; ++c) {
      kkt(f + a, c) = kkt(c, f + a) = Real(problem.rows(i, set.free[c])) / scale;
    }
  }
  Vector x = Vector::Zero(f + q);
  if (f + q > 0) {
    // Dependent rows: any multipliers of the right sign will do; a free choice is 0.
    x = solve_rank_revealing(kkt, right, 1e-15L);
  }
  Vector u = set.fixed;
  for (int r = 0; r < f; ++r) u(set.free[r]) = x(r);
  Vector multiplier(q);
  for (int a = 0; a < q; ++a) multiplier(a) = x(f + a) * unit / row_scale(problem, set.rows[a]);
  QpReference out{.power = std::vector<Real>(u.data(), u.data() + u.size()),
                  .kkt_violation = violation(problem, set, u, multiplier)};
  if (!(out.kkt_violation <= tolerance)) return {};
  return out;
}

}  // namespace photocoag
