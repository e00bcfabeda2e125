#include "photocoag/certify/cell_problem.hpp"

#include <algorithm>
#include <bit>

namespace photocoag {

CellProblem::CellProblem(const ReducedModel& model, const ControlSettings& settings,
                         const CertifiedBox& box, long long cycle)
    : n_(settings.horizon - 1),
      coefficients_(settings.horizon + (settings.power_change_weight > 0.0 ? 1 : 0)),
      box_(box),
      lower_(settings.power_min / settings.power_max),
      peak_max_(settings.peak_max) {
  condense(model, settings, cycle);
}

bool CellProblem::invert(std::array<std::array<Varying, kMaxStages>, kMaxStages> matrix, int size,
                         std::array<std::array<Varying, kMaxStages>, kMaxStages>& inverse) const {
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) inverse[i][j] = Varying(i == j ? 1.0 : 0.0);
  }
  for (int k = 0; k < size; ++k) {
    if (!(matrix[k][k].range().low > 0.0)) return false;
    const Varying pivot = reciprocal(matrix[k][k]);
    for (int j = 0; j < size; ++j) {
      if (j > k) matrix[k][j] = matrix[k][j] * pivot;
      if (j <= k) inverse[k][j] = inverse[k][j] * pivot;
    }
    for (int i = 0; i < size; ++i) {
      if (i == k) continue;
      const Varying factor = matrix[i][k];
      for (int j = k + 1; j < size; ++j) matrix[i][j] = matrix[i][j] - factor * matrix[k][j];
      for (int j = 0; j <= k; ++j) inverse[i][j] = inverse[i][j] - factor * inverse[k][j];
    }
  }
  return true;
}

void CellProblem::set_row(int i, RowState state) {
  rows_[i] = state;
  known_.clear();
}

std::vector<Inequality> CellProblem::row_conditions(int i, RowState state) const {
  // Below the limit by at least what the largest powers add; by less; or not at all.
  const Affine room = [&] {
    Affine a{};
    a[0] = Varying(Interval(peak_max_) - Interval(box_.free[i].middle()));
    a[1 + i] = Varying(-box_.free[i].radius() * (1.0 + 1e-15));
    return a;
  }();
  const auto less = [&](const Varying& reach) {
    Affine a = room;
    a[0] = a[0] - reach;
    return a;
  };
  const Affine above_largest = less(sum_[i] * first_);
  const Affine above_least = less(sum_[i] * first_ * Varying(lower_));
  const Affine none{};
  const auto minus = [&](const Affine& a) { return combine(none, Varying(0.0), a, Varying(-1.0)); };
  const double scale = size(room) + (sum_[i] * first_).range().magnitude();
  if (state == RowState::kLeftOut) return {at_least_zero(above_largest, scale)};
  if (state == RowState::kRelaxed) return {at_least_zero(minus(above_least), scale)};
  return {at_least_zero(minus(above_largest), scale), at_least_zero(above_least, scale)};
}

std::array<Varying, kMaxStages> CellProblem::normal(int constraint) const {
  std::array<Varying, kMaxStages> result;
  if (constraint < 2 * n_) {
    result[constraint % n_] = Varying(constraint < n_ ? -1.0 : 1.0);
    return result;
  }
  const int i = constraint - 2 * n_;
  if (i == 0) {
    result[0] = Varying(1.0);
    return result;
  }
  for (int j = 0; j <= i; ++j) result[j] = impulse_[i - j] * sum_inverse_[i];
  return result;
}

Affine CellProblem::offset(int constraint) const {
  Affine result{};
  if (constraint < 2 * n_) {
    result[0] = first_ * Varying(constraint < n_ ? -lower_ : 1.0);
    return result;
  }
  const int i = constraint - 2 * n_;
  if (rows_[i] == RowState::kRelaxed) {
    result[0] = first_ * Varying(lower_);
    return result;
  }
  result[0] = Varying(Interval(peak_max_) - Interval(box_.free[i].middle())) * sum_inverse_[i];
  result[1 + i] = Varying(-box_.free[i].radius() * (1.0 + 1e-15)) * sum_inverse_[i];
  return result;
}

// The inputs that a constraint moves, as bits.
unsigned CellProblem::support(int constraint) const noexcept {
  return constraint < 2 * n_ ? 1U << (constraint % n_) : (2U << (constraint - 2 * n_)) - 1U;
}

// Met with equality where the inputs it moves are at their lower bound.
bool CellProblem::at_least(int constraint) const noexcept {
  return constraint < n_ ||
         (constraint >= 2 * n_ && rows_[constraint - 2 * n_] == RowState::kRelaxed);
}

// The smallest set of inputs that holds those of the constraint and all of as many independent
// members; 0 if there is none.
unsigned CellProblem::spanned(ActiveSet set, int constraint, bool pinned) const noexcept {
  unsigned smallest = 0;
  for (unsigned inputs = 1; inputs < (1U << n_); ++inputs) {
    if ((support(constraint) & ~inputs) != 0) continue;
    if (smallest != 0 && std::popcount(smallest) <= std::popcount(inputs)) continue;
    int inside = 0;
    for (int c = 0; c < 3 * n_; ++c) {
      if (((set >> c) & 1U) != 0 && (support(c) & ~inputs) == 0 && (!pinned || at_least(c))) {
        ++inside;
      }
    }
    if (inside == std::popcount(inputs)) smallest = inputs;
  }
  return smallest;
}

bool CellProblem::spanned_by_bounds(ActiveSet set, int constraint) const noexcept {
  return (support(constraint) & ~(set & ((1U << n_) - 1U))) == 0;
}

bool CellProblem::is_met_exactly(ActiveSet set, int constraint) const noexcept {
  // The first row and the bounds of the first input are about the same number, in a known order.
  const bool row = rows_[0] != RowState::kLeftOut && ((set >> (2 * n_)) & 1U) != 0;
  if (row && constraint % n_ == 0 && constraint < 2 * n_) return true;
  // Nothing is below the lower bounds, and they keep every row.
  if (constraint >= 2 * n_ && spanned_by_bounds(set, constraint)) return true;
  return at_least(constraint) && spanned(set, constraint, true) != 0;
}

const Equality& CellProblem::equality(ActiveSet set) {
  const auto [place, is_new] = known_.try_emplace(set);
  Equality& e = place->second;
  if (!is_new) return e;
  for (int c = 0; c < 3 * n_; ++c) {
    if (((set >> c) & 1U) != 0) e.members.push_back(c);
  }
  const int q = static_cast<int>(e.members.size());
  std::vector<std::array<Varying, kMaxStages>> normals;
  for (const int c : e.members) {
    normals.push_back(normal(c));
    std::array<Varying, kMaxStages> reach;
    for (int j = 0; j < n_; ++j) {
      for (int l = 0; l < n_; ++l) {
        reach[j] = reach[j] + hessian_inverse_[j][l] * normals.back()[l];
      }
    }
    e.reach.push_back(reach);
  }
  std::array<std::array<Varying, kMaxStages>, kMaxStages> gram;
  for (int k = 0; k < q; ++k) {
    for (int l = 0; l < q; ++l) {
      gram[k][l] = Varying(0.0);
      for (int j = 0; j < n_; ++j) gram[k][l] = gram[k][l] + normals[k][j] * e.reach[l][j];
    }
  }
  if (!invert(gram, q, e.inverse)) {
    for (int k = 0; k < q; ++k) {
      for (int l = 0; l < q; ++l) e.inverse[k][l] = Varying(Interval(-kUnbounded, kUnbounded));
    }
  }
  e.power = unconstrained_;
  std::vector<Affine> excess;
  for (int k = 0; k < q; ++k) {
    Affine sum = combine({}, Varying(0.0), offset(e.members[k]), Varying(-1.0));
    for (int j = 0; j < n_; ++j) {
      sum = combine(sum, Varying(1.0), unconstrained_[j], normals[k][j]);
    }
    excess.push_back(sum);
  }
  for (int k = 0; k < q; ++k) {
    Affine multiplier{};
    for (int l = 0; l < q; ++l) {
      multiplier = combine(multiplier, Varying(1.0), excess[l], e.inverse[k][l]);
    }
    for (int j = 0; j < n_; ++j) {
      e.power[j] = combine(e.power[j], Varying(1.0), multiplier, -e.reach[k][j]);
    }
    e.multiplier.push_back(multiplier);
  }
  return e;
}

Directions CellProblem::directions(ActiveSet set, int entering) {
  const Equality& e = equality(set);
  const int q = static_cast<int>(e.members.size());
  const auto n = normal(entering);
  std::array<Varying, kMaxStages> w;
  Directions d;
  Varying whole(0.0);
  for (int j = 0; j < n_; ++j) {
    for (int l = 0; l < n_; ++l) whole = whole + n[j] * hessian_inverse_[j][l] * n[l];
    for (int k = 0; k < q; ++k) w[k] = w[k] + e.reach[k][j] * n[j];
  }
  d.curvature = whole;
  for (int k = 0; k < q; ++k) {
    for (int l = 0; l < q; ++l) d.rate[k] = d.rate[k] + e.inverse[k][l] * w[l];
  }
  for (int k = 0; k < q; ++k) d.curvature = d.curvature - w[k] * d.rate[k];
  // In a span the representation is unique: members that reach beyond it take no part.
  const unsigned inputs = spanned(set, entering, false);
  d.dependent = inputs != 0;
  for (int k = 0; d.dependent && k < q; ++k) {
    if ((support(e.members[k]) & ~inputs) != 0) d.rate[k] = Varying(0.0);
  }
  // DenseSolver: the square of the sine above 1e-20.
  d.decided = d.dependent || d.curvature.range().low > 1e-12 * whole.range().high;
  return d;
}

Affine CellProblem::violation(const Equality& at, int constraint) const {
  const auto n = normal(constraint);
  Affine sum = combine({}, Varying(0.0), offset(constraint), Varying(-1.0));
  for (int j = 0; j < n_; ++j) sum = combine(sum, Varying(1.0), at.power[j], n[j]);
  return sum;
}

Affine CellProblem::combine(const Affine& a, const Varying& x, const Affine& b,
                            const Varying& y) const {
  Affine sum{};
  for (int i = 0; i < coefficients_; ++i) sum[i] = a[i] * x + b[i] * y;
  return sum;
}

double CellProblem::size(const Affine& value) const noexcept {
  double sum = 0.0;
  for (int i = 0; i < coefficients_; ++i) sum += value[i].range().magnitude();
  return sum;
}

Inequality CellProblem::at_least_zero(const Affine& value, double size) const {
  // Times 1 + kappa t > 0, so that the coefficients of x change little in the cell.
  double weight = 0.0;
  std::array<double, Varying::kPlaces> slope{};
  for (int i = 1; i < coefficients_; ++i) {
    const double m = value[i].at_middle.middle();
    weight += m * m;
    for (int s = 0; s < Varying::kPlaces; ++s) slope[s] -= m * value[i].slope[s].middle();
  }
  Varying factor(1.0);
  for (int s = 0; s < Varying::kPlaces && weight > 0.0; ++s) {
    factor.slope[s] = Interval(std::clamp(slope[s] / weight, -0.4, 0.4));
  }
  Inequality result;
  double slack = 0.0;
  for (int i = 0; i < coefficients_; ++i) {
    const Varying c = value[i] * factor;
    slack += c.at_middle.radius();
    (i == 0 ? result.offset : result.slope[i - 1]) = c.at_middle.middle();
    for (int s = 0; s < Varying::kPlaces; ++s) {
      if (i == 0) {
        result.slope[coefficients_ - 1 + s] = c.slope[s].middle();
        slack += c.slope[s].radius();
      } else {
        slack += c.slope[s].magnitude();
      }
    }
  }
  result.offset += slack * (1.0 + 1e-12) + kUndecided * size;
  return result;
}

}  // namespace photocoag
