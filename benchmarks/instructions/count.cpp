// `photocoag_count_cycle TREATMENTS`: the parts of a control cycle, each on its own, for callgrind,
// which benchmarks/instructions/run starts. Replays treatments of the default configuration on the
// reduced eye; each part gets what it gets in the loop. Prints the cycles that were counted.
#include <fmt/format.h>
#include <valgrind/callgrind.h>

#include <cstdlib>
#include <exception>
#include <span>
#include <vector>

#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag::benchmarks {
namespace {

constexpr std::size_t kCycles = 250;

// What a cycle knew and decided.
struct Cycle {
  DeviceSample sample;
  Readback readback;
  StateVector state;  // after the sample
  StateVector input;
  double previous_power;
  ControllerReport report;
};

Supervisor supervisor_of(const Config& config) {
  return begun_supervisor(safety_limits(config), observer_model(config),
                          passed_self_test(config.plant.noise));
}

std::vector<Cycle> record(const Config& config, const ReducedModel& model, double alpha,
                          std::uint64_t seed) {
  SimulatedEye device(ReducedPlant(model, AbsorptionFactors(alpha)), config.plant.noise, seed, {},
                      VirtualPace(config.control.period));
  Controller controller(model, config.control, config.estimator);
  double power = controller.decide().power;
  std::vector<Cycle> cycles;
  for (std::size_t k = 0; k < kCycles; ++k) {
    device.write_power(power, k + 1);
    Cycle cycle{.sample = device.wait_sample(k),
                .readback = device.readback(),
                .state = {},
                .input = {},
                .previous_power = power,
                .report = {}};
    const Estimate estimate =
        controller.observe({.volume_temperature = cycle.sample.volume_temperature,
                            .applied_power = cycle.readback.power});
    cycle.state = controller.filter().state();
    cycle.input = controller.filter().matrices().input;
    const Decision decision = controller.decide();
    cycle.report = report_of(estimate, decision, innovation_of(controller));
    power = decision.power;
    cycles.push_back(cycle);
  }
  return cycles;
}

// Counts work(cycle) of one treatment under `name`.
template <typename Work>
void count(const char* name, const std::vector<Cycle>& cycles, Work work) {
  CALLGRIND_ZERO_STATS;
  CALLGRIND_TOGGLE_COLLECT;
  for (std::size_t k = 0; k < cycles.size(); ++k) work(cycles[k], static_cast<long long>(k) + 1);
  CALLGRIND_TOGGLE_COLLECT;
  CALLGRIND_DUMP_STATS_AT(name);
}

double sink = 0.0;

void count_parts(const Config& config, const ReducedModel& model,
                 const std::vector<Cycle>& cycles) {
  count("nothing", cycles, [](const Cycle& c, long long) { sink += c.previous_power; });
  AnyEstimator filter(model, config.estimator);
  count("filter", cycles, [&](const Cycle& c, long long) {
    filter.predict(c.previous_power);
    filter.update(c.sample.volume_temperature);
  });
  OptimalControlProblem ocp(model, config.control);
  count("condensing", cycles, [&](const Cycle& c, long long n) {
    ocp.respond({.state = c.state, .input = c.input, .cycle = n});
  });
  ModelPredictiveController<DenseSolver> mpc(model, config.control);
  count("condensing and solving", cycles, [&](const Cycle& c, long long n) {
    sink += mpc.solve(c.state, c.input, n, c.previous_power).power;
  });
  std::vector<QpProblem> problems;
  for (std::size_t k = 0; k < cycles.size(); ++k) {
    mpc.solve(cycles[k].state, cycles[k].input, static_cast<long long>(k) + 1,
              cycles[k].previous_power);
    problems.push_back(mpc.problem());
  }
  DenseSolver dense;
  QpSolution solution;
  count("dense", cycles, [&](const Cycle&, long long n) {
    dense.solve(problems[static_cast<std::size_t>(n - 1)], solution);
  });
  Controller controller(model, config.control, config.estimator);
  controller.decide();
  count("whole controller", cycles, [&](const Cycle& c, long long) {
    sink += controller
                .step({.volume_temperature = c.sample.volume_temperature,
                       .applied_power = c.readback.power})
                .power;
  });
  count("outputs", cycles,
        [&](const Cycle&, long long) { sink += controller.estimate().peak_sigma; });
  Supervisor supervisor = supervisor_of(config);
  supervisor.authorize({.command = cycles.front().previous_power, .solve = SolveOutcome::kSolved});
  count("supervisor", cycles, [&](const Cycle& c, long long) {
    supervisor.check(c.sample, c.readback, DeviceStatus::kGood);
    sink += supervisor.authorize(c.report).power;
  });
}

int run() {
  const Config config = load_config("", {});
  ModelStore models(config, true);
  constexpr double kAlphas[] = {0.35, 0.7363, 1.1, 1.5};
  std::uint64_t seed = 0;
  for (const double alpha : kAlphas) {
    count_parts(config, models.reduced(), record(config, models.reduced(), alpha, ++seed));
  }
  fmt::print("{}\n", kCycles * std::size(kAlphas));
  return sink == 0.0 ? 1 : 0;
}

}  // namespace
}  // namespace photocoag::benchmarks

int main() {
  try {
    return photocoag::benchmarks::run();
  } catch (const std::exception& error) {
    fmt::print(stderr, "photocoag_count_cycle: {}\n", error.what());
    return 2;
  }
}
