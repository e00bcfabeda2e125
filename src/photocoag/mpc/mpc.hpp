// Role: online; model predictive control: condense, solve, first power. Used by loop.
// Source: paper, Algorithm 1, lines 3 and 7. Units: SI. Real time: noexcept, bounded,
// allocation-free.
#pragma once

#include <algorithm>
#include <concepts>
#include <string_view>
#include <utility>

#include "photocoag/core/real_time.hpp"
#include "photocoag/mpc/ocp.hpp"
#include "photocoag/mpc/penalized_plan.hpp"
#include "photocoag/qp/dense.hpp"

namespace photocoag {

enum class MpcStatus {
  kSolved,     ///< u_0 is the minimizer
  kRelaxed,    ///< the same, with the limit relaxed because even the smallest powers exceed it
  kFailed,     ///< the solver gave no answer: u_0 = 0
  kKktFailed,  ///< its answer does not satisfy the KKT conditions: u_0 = 0
  kStopped,    ///< nothing was solved: a stop was asked for, u_0 = 0
};

constexpr std::string_view to_string(MpcStatus status) noexcept {
  constexpr std::string_view names[] = {"solved", "limit_relaxed", "failed", "kkt_failed",
                                        "stopped"};
  return names[static_cast<std::size_t>(status)];
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

/// What the controller needs of an MPC, whatever its solver.
template <typename M>
concept PredictiveController = requires(M mpc, const M& constant, const StateVector& vector,
                                        long long cycle, double power) {
  { constant.ocp() }
  noexcept->std::same_as<const OptimalControlProblem&>;
  { mpc.solve(vector, vector, cycle, power) }
  noexcept->std::same_as<MpcResult>;
};

/// One solve per cycle. Keeps the previous power for the variation term; u_prev of cycle 0 is u_ref
/// (paper).
template <QpSolver Solver>
class ModelPredictiveController {
 public:
  ModelPredictiveController(const ReducedModel& model, const ControlSettings& settings,
                            Solver solver = Solver())
      : ocp_(model, settings), solver_(std::move(solver)) {}

  /// The power of cycle n = 0, 1, … from the estimate (x, B(alpha)). `previous_power`: W, applied
  /// last.
  MpcResult solve(const StateVector& state, const StateVector& input, long long cycle,
                  double previous_power,
                  const LimitTightening* tightening = nullptr) noexcept PHOTOCOAG_NONBLOCKING {
    MpcResult result;
    result.power_reference = ocp_.steady_power(input, cycle);
    assembled_ = {cycle, result.power_reference,
                  cycle == 0 ? result.power_reference : previous_power, false};
    ocp_.respond({.state = state, .input = input, .cycle = cycle, .tightening = tightening});
    // Exact where nothing binds: `dense` would start at the same plan and change nothing.
    // Another solver was chosen by the user, so it is always called.
    if constexpr (std::same_as<Solver, DenseSolver>) {
      if (take_plan()) {
        result.solver_status = QpStatus::kSolved;
        result.kkt_residual = solution_.kkt_residual;
        result.status = ocp_.limit_relaxed() ? MpcStatus::kRelaxed : MpcStatus::kSolved;
        result.power = solution_.power[0] * ocp_.power_max();
        return result;
      }
    }
    result.solver_status = solver_.solve(problem(), solution_);
    result.iterations = solution_.iterations;
    result.kkt_residual = solution_.kkt_residual;
    // Never read the solution before its status.
    if (result.solver_status == QpStatus::kKktFailed) result.status = MpcStatus::kKktFailed;
    if (result.solver_status != QpStatus::kSolved) return result;
    result.status = ocp_.limit_relaxed() ? MpcStatus::kRelaxed : MpcStatus::kSolved;
    result.limit_active = (solution_.row_multiplier.array() > 0.0).any();
    result.power = solution_.power[0] * ocp_.power_max();
    return result;
  }

  /// Power of stage k = 0 … N-2 of the last plan, W; 0 if there is none.
  double planned(int stage) const noexcept {
    return solution_.status == QpStatus::kSolved ? solution_.power[stage] * ocp_.power_max() : 0.0;
  }

  const OptimalControlProblem& ocp() const noexcept { return ocp_; }
  /// The quadratic program of the last solve(), assembled on demand.
  const QpProblem& problem() const noexcept {
    if (!assembled_.done) {
      assembled_.done = true;
      ocp_.assemble(assembled_.cycle, assembled_.power_reference, assembled_.previous_power,
                    problem_);
    }
    return problem_;
  }
  const QpSolution& solution() const noexcept { return solution_; }

 protected:
  Solver& solver() noexcept { return solver_; }

 private:
  struct Assembled {
    long long cycle = 0;
    double power_reference = 0.0;
    double previous_power = 0.0;
    bool done = true;
  };

  // The plan without box and limits, if it is the minimizer by its check.
  bool take_plan() noexcept {
    const bool deadbeat = ocp_.deadbeat_is_optimal();
    if (!deadbeat && !ocp_.penalized_is_optimal(assembled_.cycle)) return false;
    const PlanData data = ocp_.plan_data();
    solution_.power.resize(data.stages);
    double* u = solution_.power.data();
    if (deadbeat) {
      if (!meet_reference(data, u)) return false;
      solution_.kkt_residual = deadbeat_residual(data, u);
    } else {
      const PlanPenalties penalties =
          ocp_.plan_penalties(assembled_.power_reference, assembled_.previous_power);
      if (!minimize_penalized(data, penalties, u)) return false;
      solution_.kkt_residual = penalized_residual(data, penalties, u);
    }
    if (!(solution_.kkt_residual <= kDeadbeatResidual)) return false;
    solution_.bound_multiplier.setZero(data.stages);
    solution_.row_multiplier.setZero(data.stages);
    solution_.status = QpStatus::kSolved;
    solution_.iterations = 0;
    return true;
  }

  OptimalControlProblem ocp_;
  Solver solver_;
  mutable Assembled assembled_;
  mutable QpProblem problem_;
  QpSolution solution_;
};

}  // namespace photocoag
