// Role: offline; the condensed problem (E20) and the solver's intermediate results on a small box
// of absorption factors, as functions of the remaining parameters. Used by certify/paths.
// Source: docs/certify.md; D. Goldfarb, A. Idnani (1983), the algorithm of qp/dense.
// Units: v = u / u_max, K. Real time: none. Threads: one owner.
#pragma once

#include <array>
#include <bitset>
#include <unordered_map>
#include <vector>

#include "photocoag/certify/interval.hpp"
#include "photocoag/certify/parameter_box.hpp"
#include "photocoag/certify/region.hpp"

namespace photocoag {

inline constexpr int kMaxCoefficients = kMaxStages + 2;  // 1, f_1 … f_{N-1}, u_prev

/// c_0 + sum_i c_i x_i: exact in x = (f_1 … f_{N-1}, u_prev), each scaled to [-1, 1]; the
/// coefficients vary with the position (t_1, t_2) in the cell of (alpha, beta).
using Affine = std::array<Varying, kMaxCoefficients>;

/// State of a row for some of the free responses.
enum class RowState : unsigned char {
  kLeftOut,  ///< no u in the box violates it: DenseSolver skips it
  kLimit,    ///< y_k <= y_max
  kRelaxed,  ///< only u_min keeps it
};

/// Active sets are bit masks: bit j, the lower bound of input j; n + j, its upper; 2 n + i, row i.
using ActiveSet = unsigned;

/// The equality-constrained minimizer of an active set, and its multipliers.
struct Equality {
  std::vector<int> members;                                         ///< ascending
  std::vector<std::array<Varying, kMaxStages>> reach;               ///< H^-1 n_k
  std::array<std::array<Varying, kMaxStages>, kMaxStages> inverse;  ///< (N' H^-1 N)^-1
  std::array<Affine, kMaxStages> power;                             ///< u
  std::vector<Affine> multiplier;                                   ///< one per member
};

/// What DenseSolver calls d2'd2 and r, for an entering constraint.
struct Directions {
  std::array<Varying, kMaxStages> rate;  ///< r, one per member
  Varying curvature;                     ///< d2' d2
  bool dependent = false;                ///< the normal lies in the span of the active ones
  bool decided = false;                  ///< `dependent` is certain in the whole cell
};

class CellProblem {
 public:
  /// `cycle`: the delayed weights differ in the first three. Precondition: require_certifiable().
  CellProblem(const ReducedModel& model, const ControlSettings& settings, const CertifiedBox& box,
              long long cycle);

  int inputs() const noexcept { return n_; }
  int coefficients() const noexcept { return coefficients_; }
  /// x and t.
  int dimensions() const noexcept { return coefficients_ - 1 + Varying::kPlaces; }
  /// False: the Hessian is not proved definite, or a row has no reach; call nothing else then.
  bool definite() const noexcept { return definite_; }
  /// Largest sum of a row of |H^-1| times that of |H|: at least its condition in that norm.
  double condition() const noexcept { return condition_; }

  /// Sets the state of row i.
  void set_row(int i, RowState state);
  RowState row(int i) const noexcept { return rows_[i]; }
  /// Necessary conditions for row i to be in a state.
  std::vector<Inequality> row_conditions(int i, RowState state) const;

  const Equality& equality(ActiveSet set);
  Directions directions(ActiveSet set, int entering);
  /// Value minus bound of a constraint at the minimizer on a set, scaled as DenseSolver scales it.
  Affine violation(const Equality& at, int constraint) const;
  /// True if the constraint is met exactly at every minimizer on the set, because the set fixes
  /// inputs at their lower bound.
  bool is_met_exactly(ActiveSet set, int constraint) const noexcept;

  /// The weakest inequality implied by value >= 0 in the whole cell; comparisons closer than
  /// kUndecided of `size` may go either way.
  Inequality at_least_zero(const Affine& value, double size) const;
  /// Largest sum of the terms.
  double size(const Affine& value) const noexcept;

  /// x a + y b.
  Affine combine(const Affine& a, const Varying& x, const Affine& b, const Varying& y) const;

 private:
  std::array<Varying, kMaxStages> normal(int constraint) const;
  Affine offset(int constraint) const;
  unsigned support(int constraint) const noexcept;
  bool spanned_by_bounds(ActiveSet set, int constraint) const noexcept;
  bool at_least(int constraint) const noexcept;
  unsigned spanned(ActiveSet set, int constraint, bool pinned) const noexcept;
  void condense(const ReducedModel& model, const ControlSettings& settings, long long cycle);
  bool invert(std::array<std::array<Varying, kMaxStages>, kMaxStages> matrix, int size,
              std::array<std::array<Varying, kMaxStages>, kMaxStages>& inverse) const;

  int n_;
  int coefficients_;
  CertifiedBox box_;
  double lower_;     // u_min / u_max
  double peak_max_;  // K
  bool definite_ = false;
  double condition_ = 0.0;
  Varying first_;                            // h_0 u_max: u is in units of K here, w = h_0 u
  std::array<Varying, kMaxStages> impulse_;  // h_i / h_0
  std::array<Varying, kMaxStages> sum_;      // of the first i + 1
  std::array<Varying, kMaxStages> sum_inverse_;
  std::array<std::array<Varying, kMaxStages>, kMaxStages> hessian_inverse_;
  std::array<Affine, kMaxStages> unconstrained_;  // -H^-1 g
  std::array<RowState, kMaxStages> rows_{};
  std::unordered_map<ActiveSet, Equality> known_;  // for rows_
};

/// Comparisons closer than this, relative to their terms, count as undecided in a proof: a margin
/// for the solver's rounding (docs/certify.md).
inline constexpr double kUndecided = 1e-8;

/// All u_ref of the box, W.
BoxRange reference_powers(const ReducedModel& model, const ControlSettings& settings,
                          const CertifiedBox& box);

}  // namespace photocoag
