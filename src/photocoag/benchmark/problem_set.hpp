// Role: benchmark and tests; optimal control problems of every kind that a solver may encounter:
// the paper's four choices of weights and none, cold starts, wrong estimates, active and relaxed
// limits. Used by `bench qp`, tests/slow. Units: SI. Real-time promise: none.
#pragma once

#include <string>
#include <vector>

#include "photocoag/mpc/mpc.hpp"

namespace photocoag {

/// The paper's choices at 250 Hz, a) to d), and R1 = R2 = 0.
struct WeightChoice {
  std::string name;
  StateWeight state_weight;
  double power_weight;         ///< R1, K2/W2
  double power_change_weight;  ///< R2, K2/W2
};
std::vector<WeightChoice> weight_choices();

/// Input of one decision.
struct OcpInstance {
  StateVector state;  ///< estimate of x
  StateVector input;  ///< B_d at the estimate of alpha
  long long cycle = 0;
  double previous_power = 0.0;  ///< W
};

/// Closed loops of `dense` on the reduced model, `cycles` each: alpha 0.35, 0.5, 0.7363, 1.1 and
/// 1.5, the estimate of alpha converging from 0.7363, the estimated state exact, 10 % off and 30 %
/// off (limits active and relaxed). Deterministic.
std::vector<OcpInstance> closed_loop_problems(const ReducedModel& model,
                                              const ControlSettings& settings, int cycles);

/// Deviation of a solver's powers from those of `dense`, whose error is below 1e-15 W.
struct PowerErrors {
  int problems = 0;
  int unanswered = 0;    ///< 0 W and no plan
  int limit_active = 0;  ///< problems in which the limit binds
  double largest = 0.0;  ///< |u_0 - exact| of the answers, W
  void take(const MpcResult& exact, const MpcResult& got) noexcept;
};

/// `solver` gets the problems in order, as in a closed loop.
template <PredictiveController Solver>
PowerErrors power_errors(Solver& solver, const ReducedModel& model, const ControlSettings& settings,
                         int cycles) {
  PowerErrors errors;
  ModelPredictiveController<DenseSolver> exact(model, settings);
  for (const OcpInstance& p : closed_loop_problems(model, settings, cycles)) {
    errors.take(exact.solve(p.state, p.input, p.cycle, p.previous_power),
                solver.solve(p.state, p.input, p.cycle, p.previous_power));
  }
  return errors;
}

}  // namespace photocoag
