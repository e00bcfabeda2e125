// Role: setup; the optimal control problem's data. Used by mpc and the configuration.
// Source: paper, section 3, OCP(n) and cost J_n.
#pragma once

#include <vector>

namespace photocoag {

struct Field;  // core/setting.hpp

enum class StateWeight {
  kConstant,  ///< R0 = 1
  kDelayed,   ///< the paper's chi_3: R0(j) = 0 for j = n + k in {1, 2, 3}, else 1
};

enum class SolverKind {
  kDense,          ///< DenseSolver: exact, bounded
  kOsqp,           ///< OSQP on the sparse problem, states and inputs as variables: the paper's
  kOsqpCondensed,  ///< OSQP on the condensed problem
};

/// How the peak limit is tightened.
enum class Robustness {
  kNone,       ///< nothing: the limit holds for the estimate
  kCertified,  ///< the model's running error bound and robust_sigma standard deviations (E28)
  kChance,     ///< a chance constraint on the posterior, by limit_probability
};

struct ControlSettings {
  double period = 1e-3;          ///< s, control period T; 0.05 ms to 100 ms
  int horizon = 5;               ///< N, 2 to 50; N - 1 free inputs
  double peak_reference = 30.0;  ///< K, y_peak,ref; above 0, at most 150
  double peak_max = 32.0;        ///< K, y_peak,max; above the reference, at most 150
  double power_max = 0.1;        ///< W, u_max; above 0, at most 1
  double power_min = 0.0;        ///< W; from 0, below power_max
  StateWeight state_weight = StateWeight::kConstant;
  double power_weight = 0.0;         ///< K2/W2, R1 >= 0, at most 1e9
  double power_change_weight = 0.0;  ///< K2/W2, R2 >= 0, at most 1e9
  /// Times, s, ascending from 0 on, and peak temperatures, K: linear between, constant beyond the
  /// last; both empty: peak_reference throughout.
  std::vector<double> reference_times = {};
  std::vector<double> reference_values = {};
  Robustness robust = Robustness::kNone;
  double robust_sigma = 4.0;        ///< standard deviations, 0 to 10
  double limit_probability = 1e-3;  ///< that a treatment exceeds peak_max; 1e-6 to 0.5
  /// Identification phase: duration, s, at most this long, 0 (none) to 60; power, W, an upper
  /// limit, above 0 and at most power_max; it ends early once the peak at the reference is known to
  /// this standard deviation, K, 0 (by time only) to 50.
  double identification_duration = 0.0;
  double identification_power = 0.02;
  double identification_sigma = 0.0;
  /// Periods from a sample to the power computed from it: 0 (at once) or 1.
  int delay = 0;
  /// Periods from one solution to the next, 1 to N - 1: the plan's powers in between.
  int solve_every = 1;
  double first_power = 0.0;  ///< W, fixed power of the first period; 0: solved for
  SolverKind solver = SolverKind::kDense;
  double osqp_tolerance = 1e-3;  ///< of OSQP, absolute and relative; 1e-6 to 0.1
  /// Share of reference and limit in force at the end of period 1, 2, …, the last one from then on;
  /// above 0, at most 1; empty: 1. No key: computed by run/tissue_margin.
  std::vector<double> shares = {};

  /// Reference at time t, s. No allocation.
  double reference_at(double time) const noexcept;
  /// Share of reference and limit at the end of `period` = 1, 2, …. No allocation.
  double share_at(long long period) const noexcept;

  /// Throws Error naming the key ("control.…"), the value and the range.
  void validate() const;
  bool operator==(const ControlSettings&) const = default;
};

/// The keys "control.…", bound to `settings`.
std::vector<Field> fields_of(ControlSettings& settings);

}  // namespace photocoag
