// Role: tests; the truth about small quadratic programs, by enumeration. Shares no code with a
// solver. Method: for every choice of lower, upper or free for each input and of active rows, the
// equality constrained minimizer by elimination with complete pivoting in long double; the answer
// is the point that violates the KKT conditions least. In a box every non-empty feasible set has a
// vertex, and each vertex is such a choice: if no choice is feasible, the problem is infeasible.
// Cost 3^n 2^m at worst.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "photocoag/qp/problem.hpp"

namespace photocoag::qp_exam {

using Real = long double;

struct Truth {
  bool feasible = false;
  std::vector<Real> power;  ///< u, n; empty unless feasible
  Real kkt_violation = 0;   ///< of u, scaled
};

/// max(|limit_i|, sum_j |G_ij| max(|lower_j|, |upper_j|)); 1 for a row that is no constraint.
inline Real row_scale(const QpProblem& qp, int i) {
  if (!std::isfinite(qp.limit(i))) return 1;
  Real scale = 0;
  for (int j = 0; j < qp.rows.cols(); ++j) {
    scale += std::fabs(Real(qp.rows(i, j))) *
             std::fmax(std::fabs(Real(qp.lower(j))), std::fabs(Real(qp.upper(j))));
  }
  scale = std::fmax(scale, std::fabs(Real(qp.limit(i))));
  return scale > 0 ? scale : 1;
}

/// The minimizer of `qp` with every limit raised by `relaxation` times its row's scale. n <= 6, m
/// <= 8.
class Oracle {
 public:
  explicit Oracle(const QpProblem& qp, Real relaxation = 0)
      : n_(int(qp.hessian.rows())), m_(int(qp.rows.rows())), qp_(qp) {
    for (int j = 0; j < n_; ++j) unit_ = std::fmax(unit_, Real(qp.hessian(j, j)));
    for (int i = 0; i < m_; ++i) {
      scale_.push_back(row_scale(qp, i));
      limit_.push_back(qp.limit(i) + relaxation * scale_.back());
    }
  }

  Truth solve() {
    std::array<int, 8> side{};  // -1 lower, +1 upper, 0 free
    choose_bounds(side, 0);
    Truth truth;
    truth.feasible = least_ <= kTolerance;
    truth.kkt_violation = least_;
    if (truth.feasible) truth.power = best_;
    return truth;
  }

 private:
  // Rounding of an elimination of at most 14 rows in long double (1e-19), with a condition number
  // of up to 1e6. Far below the 1e-13 with which solvers work.
  static constexpr Real kTolerance = 1e-14L;
  static constexpr int kSize = 16;

  void choose_bounds(std::array<int, 8>& side, int j) {
    if (least_ < 1e-17L) return;  // found
    if (j == n_) {
      for (unsigned set = 0; set < (1u << m_); ++set) try_set(side, set);
      return;
    }
    for (const int value : {0, 1, -1}) {
      side[j] = value;
      choose_bounds(side, j + 1);
    }
    side[j] = 0;
  }

  void try_set(const std::array<int, 8>& side, unsigned set) {
    std::vector<int> free;
    std::vector<int> rows;
    for (int j = 0; j < n_; ++j) {
      if (side[j] == 0) free.push_back(j);
    }
    for (int i = 0; i < m_; ++i) {
      if ((set >> i & 1u) == 0) continue;
      if (!std::isfinite(qp_.limit(i))) return;
      rows.push_back(i);
    }
    if (rows.size() > free.size()) return;
    const int f = int(free.size());
    const int k = f + int(rows.size());

    std::vector<Real> u(n_);
    for (int j = 0; j < n_; ++j) u[j] = side[j] > 0 ? qp_.upper(j) : qp_.lower(j);
    Real a[kSize][kSize + 1] = {};
    for (int r = 0; r < f; ++r) {
      a[r][k] = -qp_.gradient(free[r]) / unit_;
      for (int c = 0; c < f; ++c) a[r][c] = qp_.hessian(free[r], free[c]) / unit_;
      for (int j = 0; j < n_; ++j) {
        if (side[j] != 0) a[r][k] -= qp_.hessian(free[r], j) / unit_ * u[j];
      }
      for (int c = f; c < k; ++c) a[r][c] = qp_.rows(rows[c - f], free[r]) / scale_[rows[c - f]];
    }
    for (int r = f; r < k; ++r) {
      const int i = rows[r - f];
      a[r][k] = limit_[i] / scale_[i];
      for (int c = 0; c < f; ++c) a[r][c] = qp_.rows(i, free[c]) / scale_[i];
      for (int j = 0; j < n_; ++j) {
        if (side[j] != 0) a[r][k] -= qp_.rows(i, j) / scale_[i] * u[j];
      }
    }
    Real x[kSize];
    if (!eliminate(a, k, x)) return;
    for (int r = 0; r < f; ++r) u[free[r]] = x[r];

    // How far is this point from satisfying the KKT conditions?
    Real worst = 0;
    for (int j = 0; j < n_; ++j) {
      const Real box = std::fmax(std::fabs(Real(qp_.lower(j))), std::fabs(Real(qp_.upper(j))));
      const Real out = std::fmax(qp_.lower(j) - u[j], u[j] - qp_.upper(j));
      if (out > 0) worst = std::fmax(worst, box > 0 ? out / box : out);
    }
    for (int i = 0; i < m_; ++i) {
      if (!std::isfinite(qp_.limit(i))) continue;
      Real excess = -limit_[i];
      for (int j = 0; j < n_; ++j) excess += Real(qp_.rows(i, j)) * u[j];
      worst = std::fmax(worst, excess / scale_[i]);
    }
    if (worst >= least_) return;
    Real energy = 0;
    std::vector<Real> force(n_);
    for (int j = 0; j < n_; ++j) {
      force[j] = qp_.gradient(j) / unit_;
      Real size = std::fabs(force[j]);
      for (int c = 0; c < n_; ++c) {
        force[j] += qp_.hessian(j, c) / unit_ * u[c];
        size += std::fabs(qp_.hessian(j, c) / unit_ * u[c]);
      }
      for (int c = f; c < k; ++c) {
        const Real term = x[c] * qp_.rows(rows[c - f], j) / scale_[rows[c - f]];
        force[j] += term;
        size += std::fabs(term);
      }
      energy = std::fmax(energy, size);
    }
    if (energy == 0) energy = 1;
    for (int c = f; c < k; ++c) worst = std::fmax(worst, -x[c] / energy);
    for (int j = 0; j < n_; ++j) {
      // A fixed input's multiplier may have either sign.
      if (side[j] != 0 && qp_.lower(j) < qp_.upper(j))
        worst = std::fmax(worst, side[j] * force[j] / energy);
    }
    if (worst < least_) {
      least_ = worst;
      best_ = u;
    }
  }

  // Gauss-Jordan with complete pivoting on equilibrated rows; false if singular to 1e-15.
  static bool eliminate(Real (&a)[kSize][kSize + 1], int k, Real (&x)[kSize]) {
    int column[kSize];
    for (int r = 0; r < k; ++r) {
      column[r] = r;
      Real largest = 0;
      for (int c = 0; c < k; ++c) largest = std::fmax(largest, std::fabs(a[r][c]));
      if (largest == 0) return false;
      for (int c = 0; c <= k; ++c) a[r][c] /= largest;
    }
    for (int p = 0; p < k; ++p) {
      int row = p;
      int col = p;
      for (int r = p; r < k; ++r) {
        for (int c = p; c < k; ++c) {
          if (std::fabs(a[r][c]) > std::fabs(a[row][col])) row = r, col = c;
        }
      }
      if (std::fabs(a[row][col]) < 1e-15L) return false;
      if (row != p) std::swap(a[row], a[p]);
      if (col != p) {
        for (int r = 0; r < k; ++r) std::swap(a[r][col], a[r][p]);
        std::swap(column[col], column[p]);
      }
      for (int r = 0; r < k; ++r) {
        if (r == p || a[r][p] == 0) continue;
        const Real factor = a[r][p] / a[p][p];
        for (int c = p; c <= k; ++c) a[r][c] -= factor * a[p][c];
      }
    }
    for (int p = 0; p < k; ++p) x[column[p]] = a[p][k] / a[p][p];
    return true;
  }

  int n_;
  int m_;
  const QpProblem& qp_;
  Real unit_ = 0;  // of H and g: their largest diagonal entry
  std::vector<Real> scale_;
  std::vector<Real> limit_;
  Real least_ = std::numeric_limits<Real>::infinity();
  std::vector<Real> best_;
};

}  // namespace photocoag::qp_exam
