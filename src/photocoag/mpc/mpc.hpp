// Role: online; model predictive control: condense, solve, first power. Used by loop.
// Source: paper, Algorithm 1, lines 3 and 7. Units: SI. Real time: noexcept, bounded,
// allocation-free.
#pragma once

#include <algorithm>
#include <string_view>

#include "photocoag/mpc/ocp.hpp"
#include "photocoag/qp/dense.hpp"

namespace photocoag {

enum class MpcStatus {
  kSolved,   ///< u_0 is the minimizer
  kRelaxed,  ///< the same, with the limit relaxed because even the smallest powers exceed it
  kFailed,   ///< the solver gave no answer: u_0 = 0
  kStopped,  ///< nothing was solved: a stop was asked for, u_0 = 0
};

constexpr std::string_view to_string(MpcStatus status) noexcept {
  switch (status) {
    case MpcStatus::kSolved:
      return "solved";
    case MpcStatus::kRelaxed:
      return "limit_relaxed";
    case MpcStatus::kFailed:
      return "failed";
    case MpcStatus::kStopped:
      return "stopped";
  }
  return "unknown";
}

struct MpcResult {
  double power = 0.0;            ///< u_0, W
  double power_reference = 0.0;  ///< u_ref, W
  MpcStatus status = MpcStatus::kFailed;
  QpStatus solver_status = QpStatus::kNumericalFailure;
  int iterations = 0;
  bool limit_active = false;  ///< the peak limit binds at some stage of the plan
  double kkt_residual = 0.0;
};

/// One solve per cycle. Keeps the previous power for the variation term; u_prev of cycle 0 is u_ref
/// (paper).
template <QpSolver Solver>
class ModelPredictiveController {
 public:
  ModelPredictiveController(const ReducedModel& model, const ControlSettings& settings)
      : ocp_(model, settings) {}

  /// The power of cycle n = 0, 1, … from the estimate (x, B(alpha)). `previous_power`: what was
  /// applied last.
  MpcResult solve(const StateVector& state, const StateVector& input, long long cycle,
                  double previous_power) noexcept {
    MpcResult result;
    result.power_reference = ocp_.steady_power(input);
    ocp_.condense({.state = state,
                   .input = input,
                   .cycle = cycle,
                   .power_reference = result.power_reference,
                   .previous_power = cycle == 0 ? result.power_reference : previous_power},
                  problem_);
    result.solver_status = solver_.solve(problem_, solution_);
    result.iterations = solution_.iterations;
    result.kkt_residual = solution_.kkt_residual;
    // Never read the solution before its status.
    if (result.solver_status != QpStatus::kSolved) return result;
    result.status = ocp_.limit_relaxed() ? MpcStatus::kRelaxed : MpcStatus::kSolved;
    result.limit_active = (solution_.row_multiplier.array() > 0.0).any();
    result.power = solution_.power[0] * ocp_.power_max();
    return result;
  }

  const OptimalControlProblem& ocp() const noexcept { return ocp_; }
  const QpProblem& problem() const noexcept { return problem_; }

 private:
  OptimalControlProblem ocp_;
  Solver solver_;
  QpProblem problem_;
  QpSolution solution_;
};

}  // namespace photocoag
