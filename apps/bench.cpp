// `photocoag bench cycle`: computing time of one control cycle with and without supervisor, of the
// filter at two orders, and of one step of the simulated eye.
#include "bench.hpp"

#include <fmt/format.h>

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
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {
namespace {

constexpr int kTreatments = 10;
constexpr int kRepetitions = 4;  // of each, to the bit
constexpr std::size_t kCycles = 250;

// The device's data in a treatment; replaying them gives the same decisions.
struct Delivered {
  DeviceSample sample;
  Readback readback;
};
using Recording = std::vector<Delivered>;

// Models of a configuration's treatments.
struct Subject {
  std::string name;
  Config config;
  ReducedModel model;
  SafetyLimits limits;
  ObserverModel observer;
  std::vector<Recording> treatments;

  Controller controller() const { return Controller(model, config.control, config.estimator); }
  Supervisor supervisor() const {
    return begun_supervisor(limits, observer, passed_self_test(config.plant.noise));
  }
};

// The order of a cycle is run_loop()'s. `Supervised` is a Supervisor or Unsupervised.
template <typename Supervised>
class Replay {
 public:
  Replay(const Subject& subject, Supervised supervisor)
      : controller_(subject.controller()), supervisor_(std::move(supervisor)) {
    authorize(controller_.estimate());
  }
  void step(const Delivered& delivered) noexcept {
    const DeviceSample& sample = delivered.sample;
    const SampleVerdict verdict =
        supervisor_.check(sample, delivered.readback, DeviceStatus::kGood);
    authorize(controller_.observe(
        {.volume_temperature =
             verdict.usable ? sample.volume_temperature : std::numeric_limits<double>::quiet_NaN(),
         .applied_power = verdict.power}));
  }
  double power() const noexcept { return allowed_.power; }

 private:
  void authorize(const Estimate& estimate) noexcept {
    const Decision decision = controller_.decide();
    allowed_ = supervisor_.authorize(report_of(estimate, decision, innovation_of(controller_)));
  }

  Controller controller_;
  Supervised supervisor_;
  Authorization allowed_;
};

// The controller alone: sample in, power out.
class Alone {
 public:
  explicit Alone(const Subject& subject) : controller_(subject.controller()) {
    power_ = controller_.decide().power;
  }
  void step(const Delivered& delivered) noexcept {
    power_ = controller_
                 .step({.volume_temperature = delivered.sample.volume_temperature,
                        .applied_power = delivered.readback.power})
                 .power;
  }
  double power() const noexcept { return power_; }

 private:
  Controller controller_;
  double power_ = 0.0;
};

// The estimator alone.
class Filter {
 public:
  explicit Filter(const Subject& subject) : filter_(subject.model, subject.config.estimator) {}
  void step(const Delivered& delivered) noexcept {
    filter_.predict(delivered.readback.power);
    filter_.update(delivered.sample.volume_temperature);
  }
  double power() const noexcept { return filter_.outputs().peak; }

 private:
  AnyEstimator filter_;
};

// Durations of the steps of one way to do a subject's treatments, CPU time of this thread.
struct Durations {
  std::vector<double> us;        // every step, a reading of the clock each
  std::vector<double> first_us;  // of each treatment
  std::vector<double> least_us;  // every step, the least of its repetitions
  std::vector<double> mean_us;   // of each treatment, two readings for all of it; the least

  template <typename Make>
  void measure(const Recording& recording, std::size_t treatment, Make make) {
    auto whole = make();
    double begin = thread_us();
    for (const Delivered& delivered : recording) whole.step(delivered);
    const double mean = spent_us(begin) / static_cast<double>(recording.size());
    auto single = make();
    mean_us.resize(kTreatments, kInfinity);
    least_us.resize(kTreatments * kCycles, kInfinity);
    mean_us[treatment] = std::min(mean_us[treatment], mean);
    for (std::size_t cycle = 0; cycle < recording.size(); ++cycle) {
      begin = thread_us();
      single.step(recording[cycle]);
      const double spent = spent_us(begin);
      us.push_back(spent);
      double& least = least_us[treatment * kCycles + cycle];
      least = std::min(least, spent);
      if (cycle == 0) first_us.push_back(spent);
    }
    if (whole.power() != single.power()) throw Error("a treatment's replay is not the treatment");
  }
};

// A treatment on the full-order eye under the supervisor; `eye_us`: what its steps took.
Recording record(const Subject& subject, std::size_t treatment,
                 const std::shared_ptr<const FullOrderModel>& full, std::vector<double>& eye_us) {
  const Config& config = subject.config;
  SimulatedEye device(FullOrderPlant(full, config.plant.discretization, config.control.period,
                                     config.plant.absorption()),
                      config.plant.noise, treatment + 1, {}, VirtualPace(config.control.period));
  Replay<Supervisor> replay(subject, subject.supervisor());
  Recording recording;
  for (std::size_t cycle = 0; cycle < kCycles; ++cycle) {
    device.write_power(replay.power(), cycle + 1);
    const double begin = thread_us();
    const DeviceSample sample = device.wait_sample(cycle);
    eye_us.push_back(spent_us(begin));
    recording.push_back({sample, device.readback()});
    replay.step(recording.back());
  }
  return recording;
}

Json row(std::string_view name, const Durations& d) {
  const double mean = percentile(d.mean_us, 0.5);
  const double worst = percentile(d.least_us, 1.0);
  const double first = percentile(d.first_us, 0.5);
  fmt::print(stderr, "{:<40} {:8.3f} {:8.2f} {:8.2f} {:8.2f} {:8.2f} {:8.2f}\n", name, mean,
             percentile(d.us, 0.5), percentile(d.us, 0.99), worst, percentile(d.us, 1.0), first);
  return {{"name", name},
          {"mean_us", mean},
          {"median_us", percentile(d.us, 0.5)},
          {"p99_us", percentile(d.us, 0.99)},
          {"worst_step_us", worst},
          {"max_us", percentile(d.us, 1.0)},
          {"first_us_median", first}};
}

}  // namespace

double reading_us(double (*clock_us)()) {
  std::vector<double> us;
  for (int i = 0; i < 10000; ++i) {
    const double begin = clock_us();
    us.push_back(clock_us() - begin);
  }
  return percentile(us, 0.5);
}

double thread_clock_us() {
  static const double cost = reading_us(thread_us);
  return cost;
}

void write_json(const BenchOptions& options, const Json& json) {
  if (options.json == "-") {
    fmt::print("{}\n", json.dump(2));
  } else if (!options.json.empty()) {
    write_file(options.json, json.dump(2) + "\n");
  }
}

int bench_cycle(const BenchOptions& options) {
  std::vector<Subject> subjects;
  std::shared_ptr<const FullOrderModel> full;
  const auto add = [&](std::string name, Config config) {
    ModelStore models(config, true);
    if (!full) full = models.plant_full();
    subjects.push_back({.name = std::move(name),
                        .config = config,
                        .model = models.reduced(),
                        .limits = safety_limits(config),
                        .observer = observer_model(config),
                        .treatments = {}});
  };
  for (const int horizon : {2, 5, 10, 20, 50}) {
    add(fmt::format("N = {}", horizon),
        load_config("", {fmt::format("control.horizon={}", horizon)}));
  }
  if (!options.config.empty() || !options.set.empty()) {
    add(fmt::format("with {}", options.config.empty() ? "--set" : options.config),
        load_config(options.config, options.set));
  }
  const std::size_t controllers = subjects.size();
  for (const int order : {6, 14}) {
    add(fmt::format("order {}", order), load_config("", {fmt::format("model.order={}", order)}));
  }
  Durations eye;
  for (Subject& subject : subjects) {
    for (std::size_t i = 0; i < kTreatments; ++i) {
      subject.treatments.push_back(record(subject, i, full, eye.us));
    }
  }
  std::vector<Durations> filter(subjects.size());
  std::vector<Durations> alone(subjects.size());
  std::vector<Durations> unsupervised(subjects.size());
  std::vector<Durations> supervised(subjects.size());
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    for (std::size_t i = 0; i < kTreatments; ++i) {
      // Interleaved, so that disturbances of the machine affect all alike.
      for (std::size_t s = 0; s < subjects.size(); ++s) {
        const Subject& subject = subjects[s];
        const Recording& recording = subject.treatments[i];
        if (s >= controllers) {
          filter[s].measure(recording, i, [&] { return Filter(subject); });
          continue;
        }
        alone[s].measure(recording, i, [&] { return Alone(subject); });
        unsupervised[s].measure(recording, i, [&] { return Replay(subject, Unsupervised()); });
        supervised[s].measure(recording, i, [&] { return Replay(subject, subject.supervisor()); });
      }
    }
  }
  fmt::print(
      stderr,
      "photocoag {}: {} treatments of {} cycles, {} times each, interleaved; CPU time of the "
      "thread, us, {:.3f} us of clock reading taken off\n",
      version(), kTreatments, kCycles, kRepetitions, thread_clock_us());
  fmt::print(stderr, "{:<40} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}   us\n", "", "mean*", "median",
             "99 %", "worst**", "max", "first");
  Json rows = Json::array();
  for (std::size_t s = 0; s < controllers; ++s) {
    const std::string& name = subjects[s].name;
    rows.push_back(row(fmt::format("estimate, solve, gate: {}", name), alone[s]));
    rows.push_back(row(fmt::format("  and what is recorded: {}", name), unsupervised[s]));
    rows.push_back(row(fmt::format("  with the supervisor: {}", name), supervised[s]));
  }
  for (std::size_t s = controllers; s < subjects.size(); ++s) {
    rows.push_back(row(fmt::format("filter alone: {}", subjects[s].name), filter[s]));
  }
  eye.mean_us = eye.least_us = eye.us;
  eye.first_us = {eye.us.front()};
  rows.push_back(row(fmt::format("eye, full order ({} states)", full->states()), eye));
  const double whole = percentile(supervised[1].mean_us, 0.5);
  const double rest = percentile(unsupervised[1].mean_us, 0.5);
  const double orders = percentile(filter[controllers + 1].mean_us, 0.5) /
                        percentile(filter[controllers].mean_us, 0.5);
  fmt::print(stderr,
             "*  of a treatment, timed as a whole, the shortest of its repetitions: their median\n"
             "** the slowest step, each taken as the shortest of its repetitions: the algorithm's, "
             "not the machine's\n"
             "supervisor, N = 5: {:.3f} us, {:.0f} % of a supervised cycle\n"
             "filter, order 14 / order 6: {:.2f}\n",
             whole - rest, 100.0 * (whole - rest) / whole, orders);
  write_json(options, {{"bench", options.name},
                       {"version", version()},
                       {"unit", "us"},
                       {"clock_us", thread_clock_us()},
                       {"supervisor_us", whole - rest},
                       {"filter_order_14_over_6", orders},
                       {"rows", rows}});
  return 0;
}

namespace {

int bench(const BenchOptions& options) {
  if (options.name == "qp") return bench_qp(options);
  if (options.name == "first-cycle") return bench_first_cycle(options);
  return bench_cycle(options);
}

const Command kBench(
    "bench", "measure computation times on this machine", bench,
    [](CommandLine& command, BenchOptions& options) {
      command
          .add_option(
              "NAME", options.name,
              "cycle: one control cycle and one step of the eye; qp: every solver on recorded "
              "problems (the paper's Table 1); first-cycle: in 100 fresh processes")
          .required()
          .one_of({"cycle", "qp", "first-cycle"});
      command.add_option("--config", options.config, "cycle: one more row, for this configuration")
          .type_name("FILE");
      command.add_option("--set", options.set, "cycle: one key of that row, repeatable")
          .type_name("KEY=VALUE");
      command.add_option("--json", options.json, "also write the numbers; - is standard output")
          .type_name("FILE");
      command.add_option("--svg", options.svg, "qp: also draw the medians over N")
          .type_name("FILE");
      command
          .add_option("--export", options.problems,
                      "qp: also write the recorded problems with their exact answers (JSON)")
          .type_name("FILE");
      command.add_option("--repetitions", options.repetitions, "qp: how often to time every step")
          .check(whole_number_from(1, 1000))
          .type_name("n");
      command.add_flag("--one-process", options.one_process,
                       "first-cycle: measure in this process only, print microseconds");
      command.footer(footer(
          "  photocoag bench cycle\n"
          "  photocoag bench cycle --config configs/uncertain-eye.toml\n"
          "  photocoag bench qp --json bench-qp.json --svg bench-qp.svg\n"
          "  photocoag bench first-cycle\n"
          "  ./photocoag bench model       full-order steps against sparse Cholesky; a program\n"
          "                                of its own in the source tree, see benchmarks/"));
    });

}  // namespace

}  // namespace photocoag
