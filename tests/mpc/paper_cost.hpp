// Role: tests; the paper's J_n and its constraints by simulation of x+ = A x + B u, in long double.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "estimation/test_models.hpp"
#include "photocoag/mpc/ocp.hpp"

namespace photocoag::testing {

using Real = long double;

/// Everything that defines one OCP(n).
struct Instance {
  ReducedModel model;
  ControlSettings settings;
  StateVector state;
  StateVector input;
  long long cycle = 0;
  double power_reference = 0.0;
  double previous_power = 0.0;

  OcpData data() const {
    return {.state = state,
            .input = input,
            .cycle = cycle,
            .power_reference = power_reference,
            .previous_power = previous_power};
  }
};

/// B(alpha)
inline StateVector input_at(const ReducedModel& model, double alpha) {
  ParametricMatrices matrices;
  model.evaluate(alpha, matrices);
  return matrices.input;
}

/// A state that the eye can reach: `cycles` of random power up to `power_max` at random alpha.
inline StateVector reachable_state(const ReducedModel& model, Draw& draw, int cycles,
                                   double power_max) {
  StateVector state = StateVector::Zero(model.order());
  const StateVector input = input_at(model, draw.between(0.3, 1.7));
  for (int k = 0; k < cycles; ++k) {
    state = (model.A_d * state + input * draw.between(0.0, power_max)).eval();
  }
  return state;
}

/// y_1 … y_{N-1} for powers u_0 … u_{N-2}, W.
inline std::vector<Real> simulated_peaks(const Instance& ocp, const std::vector<Real>& power) {
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  const Matrix a = ocp.model.A_d.cast<Real>();
  const Vector b = ocp.input.cast<Real>();
  const Vector c = ocp.model.C_peak.cast<Real>();
  Vector x = ocp.state.cast<Real>();
  std::vector<Real> peaks;
  for (const Real u : power) {
    x = (a * x + b * u).eval();
    peaks.push_back(c.dot(x));
  }
  return peaks;
}

/// J_n of the paper (with the input terms k = 0 … N-2 that it has inputs for); without k = 0, which
/// no input changes.
inline Real paper_cost(const Instance& ocp, const std::vector<Real>& power) {
  const ControlSettings& s = ocp.settings;
  const std::vector<Real> peaks = simulated_peaks(ocp, power);
  Real cost = 0;
  for (int k = 1; k <= s.horizon - 1; ++k) {
    const long long j = ocp.cycle + k;
    const bool waived = s.state_weight == StateWeight::kDelayed && (j == 1 || j == 2 || j == 3);
    const Real error = peaks[k - 1] - s.peak_reference;
    if (!waived) cost += error * error;
  }
  for (int k = 0; k <= s.horizon - 2; ++k) {
    const Real offset = power[k] - ocp.power_reference;
    cost += s.power_weight * offset * offset;
    const Real change = power[k] - (k == 0 ? Real(ocp.previous_power) : power[k - 1]);
    cost += s.power_change_weight * change * change;
  }
  return cost;
}

}  // namespace photocoag::testing
