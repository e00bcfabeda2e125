// `photocoag bench cycle`: what one control cycle and one step of the simulated eye cost here.
#include "bench.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

#include "command.hpp"
#include "options.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/run/model_cache.hpp"

namespace photocoag {
namespace {

constexpr int kTreatments = 10;
constexpr int kRepetitions = 4;  // of each, to the bit
constexpr int kCycles = 250;

// One closed loop with the durations of its steps.
struct Contender {
  std::string name;
  ReducedModel model;
  Config config;
  std::vector<double> us;        // every controller step
  std::vector<double> first_us;  // of each treatment
  std::vector<double> least_us;  // every step of every treatment, the shortest of its repetitions
};

void treat_once(Contender& contender, int treatment, std::vector<double>* eye_us,
                const std::shared_ptr<const FullOrderModel>& full) {
  const Config& config = contender.config;
  Controller controller(contender.model, config.control, config.estimator);
  SimulatedEye eye(FullOrderPlant(full, config.plant.discretization, config.control.period,
                                  config.plant.absorption()),
                   config.plant.noise, static_cast<std::uint64_t>(treatment + 1));
  Decision decision = controller.decide();
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    eye.write(decision.power);
    auto begin = Clock::now();
    const Reading reading = eye.advance(static_cast<std::uint64_t>(cycle));
    eye_us->push_back(elapsed_us(begin));
    begin = Clock::now();
    decision = controller.step(reading.sample);
    const double us = elapsed_us(begin);
    contender.us.push_back(us);
    double& least = contender.least_us[static_cast<std::size_t>(treatment * kCycles + cycle)];
    least = std::min(least, us);
    if (cycle == 0) contender.first_us.push_back(us);
  }
}

Json row(std::string_view name, const std::vector<double>& us, double worst, double first) {
  fmt::print(stderr, "{:<40} {:8.2f} {:8.2f} {:>8} {:8.2f} {:8.2f}\n", name, percentile(us, 0.5),
             percentile(us, 0.99), std::isnan(worst) ? "-" : fmt::format("{:.2f}", worst),
             percentile(us, 1.0), first);
  return {{"name", name},
          {"median_us", percentile(us, 0.5)},
          {"p99_us", percentile(us, 0.99)},
          {"worst_step_us", worst},
          {"max_us", percentile(us, 1.0)},
          {"first_us_median", first}};
}

}  // namespace

void write_json(const BenchOptions& options, const Json& json) {
  if (options.json == "-") {
    fmt::print("{}\n", json.dump(2));
  } else if (!options.json.empty()) {
    write_file(options.json, json.dump(2) + "\n");
  }
}

int bench_cycle(const BenchOptions& options) {
  std::vector<Contender> contenders;
  std::shared_ptr<const FullOrderModel> full;
  const auto add = [&](std::string name, Config config) {
    Contender contender;
    contender.name = std::move(name);
    contender.config = std::move(config);
    contender.least_us.assign(std::size_t{kTreatments} * kCycles,
                              std::numeric_limits<double>::infinity());
    ModelStore models(contender.config, true);
    contender.model = models.reduced();
    if (!full) full = models.plant_full();
    contenders.push_back(std::move(contender));
  };
  for (const int horizon : {2, 5, 10, 20, 50}) {
    add(fmt::format("estimate, solve, gate: N = {}", horizon),
        load_config("", {fmt::format("control.horizon={}", horizon)}));
  }
  if (!options.config.empty() || !options.set.empty()) {
    add(fmt::format("with {}", options.config.empty() ? "--set" : options.config),
        load_config(options.config, options.set));
  }
  std::vector<double> eye_us;
  for (int i = 0; i < kTreatments * kRepetitions; ++i) {
    // Interleaved, so that a noisy moment of the machine hits all alike.
    for (Contender& contender : contenders) {
      treat_once(contender, i % kTreatments, &eye_us, full);
    }
  }
  fmt::print(stderr, "photocoag {}: {} treatments of {} cycles, {} times each, interleaved\n",
             version(), kTreatments, kCycles, kRepetitions);
  fmt::print(stderr, "{:<40} {:>8} {:>8} {:>8} {:>8} {:>8}   us\n", "", "median", "99 %", "worst*",
             "max", "first");
  Json rows = Json::array();
  for (const Contender& contender : contenders) {
    rows.push_back(row(contender.name, contender.us, percentile(contender.least_us, 1.0),
                       percentile(contender.first_us, 0.5)));
  }
  rows.push_back(row(fmt::format("eye, full order ({} states)", full->states()), eye_us,
                     std::numeric_limits<double>::quiet_NaN(), eye_us.front()));
  fmt::print(stderr,
             "* the slowest step, each taken as the shortest of its repetitions: the "
             "algorithm's, not the machine's\n");
  const Json json = {
      {"bench", options.name}, {"version", version()}, {"unit", "us"}, {"rows", rows}};
  write_json(options, json);
  return 0;
}

namespace {

int bench(const BenchOptions& options) {
  if (options.name == "qp") return bench_qp(options);
  if (options.name == "first-cycle") return bench_first_cycle(options);
  return bench_cycle(options);
}

const Command kBench(
    "bench", "measure computation times on this machine", [](CLI::App& command, int& exit_code) {
      const auto options = std::make_shared<BenchOptions>();
      command
          .add_option(
              "NAME", options->name,
              "cycle: one control cycle and one step of the eye; qp: every solver on recorded "
              "problems (the paper's Table 1); first-cycle: in 100 fresh processes")
          ->required()
          ->check(CLI::IsMember({"cycle", "qp", "first-cycle"}));
      command
          .add_option("--config", options->config, "cycle: one more row, for this configuration")
          ->type_name("FILE");
      command.add_option("--set", options->set, "cycle: one key of that row, repeatable")
          ->type_name("KEY=VALUE");
      command.add_option("--json", options->json, "also write the numbers; - is standard output")
          ->type_name("FILE");
      command.add_option("--svg", options->svg, "qp: also draw the medians over N")
          ->type_name("FILE");
      command
          .add_option("--export", options->problems,
                      "qp: also write the recorded problems with their exact answers (JSON)")
          ->type_name("FILE");
      command.add_option("--repetitions", options->repetitions, "qp: how often to time every step")
          ->check(whole_number_from(1, 1000))
          ->type_name("n");
      command.add_flag("--one-process", options->one_process,
                       "first-cycle: measure in this process only, print microseconds");
      command.footer(footer(
          "  photocoag bench cycle\n"
          "  photocoag bench cycle --config configs/uncertain-eye.toml\n"
          "  photocoag bench qp --json bench-qp.json --svg bench-qp.svg\n"
          "  photocoag bench first-cycle\n"
          "  ./photocoag bench model       full-order steps against sparse Cholesky; a program\n"
          "                                of its own in the source tree, see benchmarks/"));
      command.callback([options, &exit_code] { exit_code = bench(*options); });
    });

}  // namespace

}  // namespace photocoag
