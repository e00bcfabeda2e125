#include "photocoag/benchmark/problem_set.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/core/random.hpp"

namespace photocoag {

std::vector<WeightChoice> weight_choices() {
  return {{"R1 = R2 = 0", StateWeight::kConstant, 0.0, 0.0},
          {"a", StateWeight::kConstant, 5e4, 0.0},
          {"b", StateWeight::kDelayed, 5e1, 0.0},
          {"c", StateWeight::kConstant, 0.0, 5e4},
          {"d", StateWeight::kDelayed, 0.0, 5e1}};
}

std::vector<OcpInstance> closed_loop_problems(const ReducedModel& model,
                                              const ControlSettings& settings, int cycles) {
  std::vector<OcpInstance> problems;
  std::uint64_t seed = 0;
  ModelPredictiveController<DenseSolver> exact(model, settings);
  ParametricMatrices matrices;
  for (const double alpha : {0.35, 0.5, 0.7363, 1.1, 1.5}) {
    model.evaluate(alpha, matrices);
    const StateVector truth = matrices.input;
    for (const double disturbance : {0.0, 0.1, 0.3}) {
      ++seed;
      StateVector state = StateVector::Zero(model.order());
      double power = 0.0;
      for (int n = 0; n < cycles; ++n) {
        // Known to half after every sample.
        model.evaluate(alpha + (0.7363 - alpha) * std::ldexp(1.0, -n), matrices);
        const double error = disturbance * standard_normal(seed, static_cast<std::uint64_t>(n),
                                                           RandomStream::kMeasurementNoise);
        problems.push_back({.state = state * std::max(0.0, 1.0 + error),
                            .input = matrices.input,
                            .cycle = n,
                            .previous_power = power});
        const OcpInstance& p = problems.back();
        power = exact.solve(p.state, p.input, p.cycle, p.previous_power).power;
        state = (model.A_d * state + truth * power).eval();
      }
    }
  }
  return problems;
}

void PowerErrors::take(const MpcResult& exact, const MpcResult& got) noexcept {
  ++problems;
  limit_active += exact.limit_active ? 1 : 0;
  if (got.solver_status != QpStatus::kSolved) {
    ++unanswered;
  } else {
    largest = std::max(largest, std::abs(got.power - exact.power));
  }
}

}  // namespace photocoag
