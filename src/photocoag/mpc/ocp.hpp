// Role: online; the paper's optimal control problem, condensed to its N - 1 powers. Used by mpc.
// Source: paper, section 3, OCP(n) and J_n; docs/equations.md (E18) to (E22).
// Differences: corrections to the paper (input terms k = 0 … N-2, no bound at stage 0, u_ref from
// the discrete steady state); a limit that even the smallest powers exceed is relaxed to what they
// reach, so that the problem is always feasible. Units: SI. Real time: noexcept, bounded,
// allocation-free after construction.
#pragma once

#include "photocoag/core/types.hpp"
#include "photocoag/mpc/deadbeat.hpp"
#include "photocoag/mpc/penalized_plan.hpp"
#include "photocoag/mpc/settings.hpp"
#include "photocoag/qp/problem.hpp"
#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

/// R0(j) of the paper at j = n + k: 0 or 1.
double state_weight(StateWeight kind, long long stage) noexcept;

/// What the limit's rows add to the predicted peak, turning the estimate into an upper bound
/// (mpc/robust.hpp, mpc/chance.hpp). All entries not negative.
struct LimitTightening {
  StateVector input;    ///< B_d at the largest plausible alpha, order
  InputVector free;     ///< K, at stages 1 … N-1 whatever the powers
  InputVector impulse;  ///< K for u_max, i periods after the power, i = 1 … N-1
};

/// What changes from cycle to cycle.
struct OcpData {
  const StateVector& state;      ///< x_0, order
  const StateVector& input;      ///< B_d(alpha), order
  long long cycle = 0;           ///< n, for the delayed state weight
  double power_reference = 0.0;  ///< u_ref, W
  double previous_power = 0.0;   ///< u_prev, W
  const LimitTightening* tightening = nullptr;
};

/// min  sum_{k=1}^{N-1} R0(n+k) (y_k - y_ref)^2 + R1 sum_{k=0}^{N-2} (u_k - u_ref)^2
///      + R2 ((u_0 - u_prev)^2 + sum_{k=1}^{N-2} (u_k - u_{k-1})^2)
/// s.t. u_min <= u_k <= u_max,  y_k <= max(y_max, y_k at u = u_min),  k = 1 … N-1,
/// with y_k = f_k + sum_{j<k} h_{k-1-j} u_j, f_k = C_peak A^k x_0, h_i = C_peak A^i B.
/// With a tightening the limit holds for f_k + free_k + sum_{j<k} (h'_{k-1-j} + impulse_{k-1-j})
/// u_j instead of y_k, h'_i = C_peak A^i input. y_ref may change from stage to stage, and both
/// y_ref and y_max are multiplied by their period's share (ControlSettings::shares).
class OptimalControlProblem {
 public:
  /// Throws Error on bad settings or a model for another period.
  OptimalControlProblem(const ReducedModel& model, const ControlSettings& settings);

  /// The quadratic program in v = u / u_max (dimensionless; costs in K2): respond() and assemble().
  void condense(const OcpData& data, QpProblem& problem) noexcept;

  /// The outputs without inputs, the impulse responses, references and limits of all stages.
  void respond(const OcpData& data) noexcept;

  /// The quadratic program of the last respond(); state, input and tightening are those of that
  /// call.
  void assemble(long long cycle, double power_reference, double previous_power,
                QpProblem& problem) const noexcept;

  /// True if a plan that meets the reference at every stage is the minimizer wherever it is inside
  /// of the box and the limits: R1 = R2 = 0, and R0 = 1.
  bool deadbeat_is_optimal() const noexcept {
    return settings_.power_weight == 0.0 && settings_.power_change_weight == 0.0 &&
           settings_.state_weight == StateWeight::kConstant;
  }
  /// True if minimize_penalized() has the minimizer of cycle n wherever it is inside of the box and
  /// the limits: R1 + R2 > 0, and R0 = 1 at every stage.
  bool penalized_is_optimal(long long cycle) const noexcept {
    constexpr long long kUnweighted = 3;  // state_weight() is 1 from the next stage on
    return settings_.power_weight + settings_.power_change_weight > 0.0 &&
           (settings_.state_weight == StateWeight::kConstant || cycle >= kUnweighted);
  }
  /// R1, R2, u_ref and u_prev in the units of plan_data().
  PlanPenalties plan_penalties(double power_reference, double previous_power) const noexcept {
    const double scale = settings_.power_max;
    return {.power = settings_.power_weight * scale * scale,
            .change = settings_.power_change_weight * scale * scale,
            .power_reference = power_reference / scale,
            .previous = previous_power / scale};
  }
  /// The last respond() for deadbeat.hpp and penalized_plan.hpp; v = u / u_max. Valid as long as
  /// this object is.
  PlanData plan_data() const noexcept {
    return {.stages = inputs(),
            .impulse = impulse_.data(),
            .free = free_.data(),
            .reference = reference_.data(),
            .limit_impulse = tightened_ ? limit_impulse_.data() : impulse_.data(),
            .limit_free = limit_free_.data(),
            .limit = limit_.data(),
            .lower = settings_.power_min / settings_.power_max,
            .upper = 1.0};
  }

  /// u_ref = y_ref / (C_peak (I - A)^-1 B), W: the power that holds cycle n's reference in steady
  /// state.
  double steady_power(const StateVector& input, long long cycle = 0) const noexcept;

  /// y_ref at the end of period `cycle`, K: the configured one times its share.
  double reference_at(long long cycle) const noexcept;

  int inputs() const noexcept { return settings_.horizon - 1; }
  double power_max() const noexcept { return settings_.power_max; }
  const ControlSettings& settings() const noexcept { return settings_; }
  /// True if the limit had to be relaxed in the last respond() or condense().
  bool limit_relaxed() const noexcept { return limit_relaxed_; }
  /// Peak at stage k = 1 … N-1 of the last respond() for powers u_min, K.
  double free_response(int stage) const noexcept { return least_[stage - 1]; }
  /// max(share * y_max, free_response(k)), K: the limit in force at stage k = 1 … N-1.
  double peak_limit(int stage) const noexcept { return limit_[stage - 1]; }

 private:
  ControlSettings settings_;
  BoundedMatrix<kMaxHorizon, kMaxOrder> peak_powers_;  // row k: C_peak A^k, k = 0 … N-1
  StateVector steady_row_;                             // (I - A)^-T C_peak
  InputVector free_;                                   // f_1 … f_{N-1}
  InputVector impulse_;                                // h_0 … h_{N-2} times u_max
  InputVector limit_impulse_;                          // the same in the limit's rows
  InputVector limit_free_;                             // and f_1 … f_{N-1}
  InputVector reference_;                              // y_ref of y_1 … y_{N-1}, K
  InputVector least_;                                  // y_1 … y_{N-1} at u = u_min
  InputVector limit_;                                  // of y_1 … y_{N-1}, K
  bool limit_relaxed_ = false;
  bool tightened_ = false;  // the rows differ from the outputs
};

}  // namespace photocoag
