// `photocoag bench first-cycle`: the first cycle of a treatment after one dummy cycle, each time in
// a fresh process: caches and branch predictors hold only what the dummy cycle left there.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "bench.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/process.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/run/model_cache.hpp"

namespace photocoag {
namespace {

constexpr int kProcesses = 100;
constexpr double kSample = 4.0;  // K, sample of an eye after 1 ms at full power

// The first decision and the first full cycle of a treatment, us.
struct FirstCycle {
  double decide;
  double step;
};

FirstCycle measure() {
  const Config config = load_config("", {});
  ModelStore models(config, true);
  const ReducedModel& model = models.reduced();
  // As a treatment starts: a dummy cycle, then a new controller in the same place.
  std::optional<Controller> controller;
  controller.emplace(model, config.control, config.estimator);
  controller->decide();
  controller->step({.volume_temperature = kSample, .applied_power = config.control.power_max});
  controller.emplace(model, config.control, config.estimator);
  thread_clock_us();
  double begin = thread_us();
  const Decision first = controller->decide();
  const double decide = spent_us(begin);
  begin = thread_us();
  controller->step({.volume_temperature = kSample, .applied_power = first.power});
  return {decide, spent_us(begin)};
}

FirstCycle measure_in_a_process() {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  const ProgramResult result =
      run_program({program, "bench", "first-cycle", "--one-process"}, {.whole_environment = true});
  FirstCycle out{};
  if (std::sscanf(result.output.c_str(), "%lf %lf", &out.decide, &out.step) != 2) {
    throw Error({.where = program, .problem = "the process gave no numbers"});
  }
  return out;
}

}  // namespace

int bench_first_cycle(const BenchOptions& options) {
  if (options.one_process) {
    const FirstCycle cycle = measure();
    fmt::print("{:.3f} {:.3f}\n", cycle.decide, cycle.step);
    return 0;
  }
  measure();  // fills the model cache
  std::vector<double> decide;
  std::vector<double> step;
  for (int i = 0; i < kProcesses; ++i) {
    const FirstCycle cycle = measure_in_a_process();
    decide.push_back(cycle.decide);
    step.push_back(cycle.step);
  }
  fmt::print(stderr, "photocoag {}: first cycle after one dummy cycle, N = 5, {} processes\n",
             version(), kProcesses);
  fmt::print(stderr, "{:<34} {:>8} {:>8} {:>8}   us\n", "", "median", "99 %", "max");
  Json rows = Json::array();
  const auto report = [&rows](std::string_view name, const std::vector<double>& us) {
    fmt::print(stderr, "{:<34} {:8.2f} {:8.2f} {:8.2f}\n", name, percentile(us, 0.5),
               percentile(us, 0.99), percentile(us, 1.0));
    rows.push_back({{"name", name},
                    {"median_us", percentile(us, 0.5)},
                    {"p99_us", percentile(us, 0.99)},
                    {"max_us", percentile(us, 1.0)}});
  };
  report("first decision: solve, gate", decide);
  report("first estimate, solve, gate", step);
  write_json(options, {{"bench", options.name}, {"version", version()}, {"rows", rows}});
  return 0;
}

}  // namespace photocoag
