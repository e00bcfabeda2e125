// `photocoag bench cycle`: what one control cycle and one step of the simulated eye cost here.
#include <fmt/format.h>

#include <cstdio>

#include "bench.hpp"
#include "commands.hpp"
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

constexpr int kTreatments = 40;
constexpr int kCycles = 250;

// One closed loop of a horizon with the durations of its steps.
struct Contender {
  int horizon;
  ReducedModel model;
  Config config;
  std::vector<double> us;        // every controller step
  std::vector<double> first_us;  // of each treatment
};

void treat_once(Contender& contender, std::uint64_t seed, std::vector<double>* eye_us,
                const std::shared_ptr<const FullOrderModel>& full) {
  const Config& config = contender.config;
  Controller controller(contender.model, config.control, config.estimator);
  SimulatedEye eye(FullOrderPlant(full, config.plant.discretization, config.control.period,
                                  config.plant.absorption()),
                   config.plant.noise, seed);
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
    if (cycle == 0) contender.first_us.push_back(us);
  }
}

Json row(std::string_view name, const std::vector<double>& us, double first) {
  fmt::print(stderr, "{:<34} {:8.2f} {:8.2f} {:8.2f} {:8.2f}\n", name, percentile(us, 0.5),
             percentile(us, 0.99), percentile(us, 1.0), first);
  return {{"name", name},
          {"median_us", percentile(us, 0.5)},
          {"p99_us", percentile(us, 0.99)},
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
  for (const int horizon : {2, 5, 10, 20, 50}) {
    Contender contender{
        horizon, {}, load_config("", {fmt::format("control.horizon={}", horizon)}), {}, {}};
    ModelStore models(contender.config, true);
    contender.model = models.reduced();
    if (!full) full = models.plant_full();
    contenders.push_back(std::move(contender));
  }
  std::vector<double> eye_us;
  for (int i = 0; i < kTreatments; ++i) {
    // Interleaved, so that a noisy moment of the machine hits all alike.
    for (Contender& contender : contenders) {
      treat_once(contender, static_cast<std::uint64_t>(i + 1), &eye_us, full);
    }
  }
  fmt::print(stderr, "photocoag {}: {} treatments of {} cycles at 1 kHz per horizon, interleaved\n",
             version(), kTreatments, kCycles);
  fmt::print(stderr, "{:<34} {:>8} {:>8} {:>8} {:>8}   us\n", "", "median", "99 %", "max", "first");
  Json rows = Json::array();
  for (const Contender& contender : contenders) {
    rows.push_back(row(fmt::format("estimate, solve, gate: N = {}", contender.horizon),
                       contender.us, percentile(contender.first_us, 0.5)));
  }
  rows.push_back(
      row(fmt::format("eye, full order ({} states)", full->states()), eye_us, eye_us.front()));
  const Json json = {
      {"bench", options.name}, {"version", version()}, {"unit", "us"}, {"rows", rows}};
  write_json(options, json);
  return 0;
}

int bench(const BenchOptions& options) {
  if (options.name == "qp") return bench_qp(options);
  if (options.name == "first-cycle") return bench_first_cycle(options);
  return bench_cycle(options);
}

}  // namespace photocoag
