#include "photocoag/fault_table/fault_trials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photocoag/core/random.hpp"
#include "photocoag/fault_table/trial_eye.hpp"
#include "photocoag/faults/faulty_controller.hpp"
#include "photocoag/faults/faulty_device.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kAfter = 65;          // cycles after the fault
constexpr std::uint64_t kSteady = 60;       // cycle
constexpr std::size_t kNominalCycles = 80;  // enough to find the approach of the limit

/// Common data of the trials of one configuration.
struct Bench {
  Config config;
  ReducedModel model;
  ObserverModel observer;
  FullOrderPlant eye;  // cold
  ModelStore* models = nullptr;
  Controller controller;
  std::uint64_t at_limit = 0;
};

Supervisor treating(const SafetyLimits& limits, const ObserverModel& observer) {
  return begun_supervisor(limits, observer, passed_self_test(limits.noise));
}

SafetyLimits limits_for(const Bench& bench, const FaultCase& test) {
  SafetyLimits limits = safety_limits(bench.config);
  const bool of_limits = test.demand == Demand::kDone;
  const auto reason = of_limits ? test.reasons.front() : SafetyReason::kNone;
  if (reason == SafetyReason::kEnergy) limits.energy_max = 1.5e-3;
  if (reason == SafetyReason::kExposure) limits.exposure_max = 0.04;
  if (reason == SafetyReason::kThermalDose) limits.dose_max = 0.02;
  return limits;
}

TrialEye eye_for(const Bench& bench, const Injection& injection) {
  constexpr double kDriftEnd = 0.5;  // of alpha, beyond what a trial reaches
  const Config& config = bench.config;
  if (injection.fault == Fault::kLag) {
    return TrialEye(IntersamplePlant(bench.models->plant_full(), config.control.period,
                                     config.plant.absorption(),
                                     {.averaging = injection.averaging,
                                      .sample_lag = injection.sample_lag,
                                      .power_lag = injection.power_lag},
                                     0.0));
  }
  const bool jump = injection.fault == Fault::kJump;
  if (!jump && injection.fault != Fault::kDrift) {
    return TrialEye(ChangingEye(bench.eye, {}, 0, 0.0));
  }
  const double drift_end = injection.value < 0.0 ? -kDriftEnd : kDriftEnd;
  AbsorptionFactors later = config.plant.absorption();
  later.alpha = jump ? injection.value : later.alpha * (1.0 + drift_end);
  return TrialEye(ChangingEye(
      bench.eye,
      FullOrderPlant(bench.models->plant_full(), config.plant.discretization, config.control.period,
                     later),
      injection.start, jump ? 1.0 : injection.value * config.control.period * 1e3 / drift_end));
}

/// Cycles of a treatment after its fault; for open hazards at least 80 ms.
std::size_t cycles_after(const FaultCase& test, const Config& config) {
  if (test.demand != Demand::kReport) return kAfter;
  return std::max(kAfter, static_cast<std::size_t>(std::lround(0.08 / config.control.period)));
}

struct Recorded {
  std::vector<CycleRecord> records;
  LoopOutcome outcome;
  TrialRecord trial;
  bool solves_like_cold = true;
};

/// Virtual-time device with a hook: flips a bit of the supervisor's limits in one cycle.
template <Device D, class S>
class HookedDevice : public FaultyDevice<D> {
 public:
  HookedDevice(D& device, const Injection& injection, TrialRecord& trial, std::size_t cycles,
               S& supervisor)
      : FaultyDevice<D>(device, injection, trial, cycles),
        injection_(injection),
        trial_(trial),
        supervisor_(supervisor) {}
  DeviceSample wait_sample(std::uint64_t cycle) noexcept {
    const DeviceSample sample = FaultyDevice<D>::wait_sample(cycle);
    if (injection_.fault == Fault::kHook && injection_.active(cycle)) {
      trial_.visible = static_cast<std::int64_t>(cycle);
      if constexpr (requires { supervisor_.limits_memory(); }) {
        supervisor_.limits_memory().memory()[8 + cycle % 16] ^= std::byte{16};
      }
    }
    return sample;
  }

 private:
  Injection injection_;
  TrialRecord& trial_;
  S& supervisor_;
};

template <class S>
Recorded run_one(const Bench& bench, const FaultCase& test, S supervisor) {
  Recorded result;
  const std::size_t cycles =
      static_cast<std::size_t>(test.injection.start) + cycles_after(test, bench.config);
  result.records.resize(cycles);
  const double period = bench.config.control.period;
  SimulatedEye device(eye_for(bench, test.injection), bench.config.plant.noise,
                      bench.config.run.seed,
                      {.delay = bench.config.control.delay,
                       .power_lag = test.injection.power_lag,
                       .readback = test.injection.emitted_is_read},
                      LatePace(period, test.injection, result.trial));
  HookedDevice faulty(device, test.injection, result.trial, cycles, supervisor);
  FaultyController controller(bench.controller, test.injection, result.trial);
  result.outcome = run_loop(controller, faulty, supervisor, period, std::span(result.records));
  result.records.resize(result.outcome.cycles);
  if (test.id == "S4") {
    // After the fault: compare the controller that experienced it with one that only gets the
    // state.
    Controller lived = controller.inside();
    ModelPredictiveController<DenseSolver> cold(bench.model, bench.config.control);
    double previous = result.records.back().power;
    StateVector state = lived.filter().state();
    const StateVector& input = lived.filter().matrices().input;
    if (bench.config.control.delay == 1) {  // from the end of the period that is to come
      previous = result.records.back().decision.power;
      state = (bench.model.A_d * state + input * previous).eval();
    }
    const MpcResult expected = cold.solve(
        state, input, static_cast<long long>(cycles) + bench.config.control.delay, previous);
    result.solves_like_cold = std::abs(lived.decide().power - expected.power) <= 1e-9;
  }
  return result;
}

bool among(const std::vector<SafetyReason>& reasons, SafetyReason reason) {
  return std::find(reasons.begin(), reasons.end(), reason) != reasons.end();
}

TrialResult judge(const Bench& bench, const FaultCase& test, const Recorded& run) {
  const SafetyStatus& safety = run.outcome.safety;
  TrialResult result{.moment = test.injection.start, .why = {}};
  const auto demand = [&](bool ok, std::string_view what) {
    if (!ok && result.why.empty()) result.why = what;
  };
  bool noticed = among(test.reasons, safety.reason) || among(test.reasons, safety.last_detection);
  for (std::size_t k = 0; k < run.records.size(); ++k) {
    const CycleRecord& record = run.records[k];
    result.peak = std::max(result.peak, record.truth.peak);
    noticed = noticed || among(test.reasons, record.sample.reason) ||
              among(test.reasons, record.authorization.reason);
    demand(record.cycle == static_cast<std::int64_t>(k), "a record is missing");
    if (test.estimator_deaf && test.injection.active(k)) {
      demand(record.estimate.status != UpdateStatus::kUpdated, "a bad sample was used");
    }
  }
  result.stopped = run.outcome.stopped;
  const bool must_stop = test.demand == Demand::kStop || test.demand == Demand::kStandby ||
                         test.demand == Demand::kDone;
  result.detected = noticed || (test.reasons.empty() && safety.detections > 0);
  const std::int64_t visible = run.trial.visible;
  if (test.injection.fault != Fault::kNone) {
    demand(visible != TrialRecord::kNever, "the fault never came");
    result.reaction = run.trial.light_after_visible();
  }
  if (must_stop) {
    const SafetyState state = test.demand == Demand::kStop      ? SafetyState::kSafeStop
                              : test.demand == Demand::kStandby ? SafetyState::kStandby
                                                                : SafetyState::kDone;
    demand(safety.state == state, "not stopped");
    demand(among(test.reasons, safety.reason), "wrong reason");
    demand(result.reaction <= test.off_within + bench.config.control.delay, "too slow");
    demand(run.trial.emitted.empty() || run.trial.emitted.back() == 0.0, "light at the end");
  }
  if (test.demand == Demand::kContinue) {
    result.false_stop = result.stopped;
    demand(!result.stopped, "stopped though it had to go on");
    demand(noticed, "not noticed");
  }
  if (test.demand == Demand::kLegal) {
    for (const CycleRecord& record : run.records) {
      demand(std::isfinite(record.estimate.outputs.peak), "the estimate broke");
    }
  }
  if (test.demand == Demand::kDone) {
    const SafetyLimits limits = limits_for(bench, test);
    demand(safety.energy <= limits.energy_max, "too much energy");
    demand(safety.exposure <= limits.exposure_max + 1e-9, "too long");
  }
  if (test.interlock) {
    demand(run.trial.interlock_call != TrialRecord::kNever &&
               run.trial.interlock_call <= visible + test.off_within,
           "interlock not opened");
  }
  demand(
      test.demand == Demand::kReport || result.peak <= bench.config.control.peak_max + test.margin,
      "peak too high");
  demand(run.solves_like_cold, "solves differ from cold ones");
  result.passed = result.why.empty();
  return result;
}

/// Where a trial took place, for the message about its failure.
std::string place_of(const Config& config, std::uint64_t moment) {
  return fmt::format("alpha {}, N {}, {} ms, delay {}, cycle {}", config.plant.absorption_factor,
                     config.control.horizon, config.control.period * 1e3, config.control.delay,
                     moment);
}

void add_to(FaultRow& row, const FaultCase& test, const TrialResult& result, const Config& config) {
  ++row.runs;
  row.passed += result.passed ? 1 : 0;
  row.detected += result.detected ? 1 : 0;
  row.stopped += result.stopped ? 1 : 0;
  row.false_stops += result.false_stop ? 1 : 0;
  row.peak = std::max(row.peak, result.peak);
  double& peak = row.peak_at[config.control.period];
  peak = std::max(peak, result.peak);
  if (test.demand == Demand::kStop || test.demand == Demand::kStandby) {
    row.slowest = std::max(row.slowest, result.reaction);
  }
  if (!result.passed && row.first_failure.empty()) {
    row.first_failure =
        fmt::format("{}, {}: {} (peak {:.2f} K, {} cycles)", test.what,
                    place_of(config, result.moment), result.why, result.peak, result.reaction);
  }
}

Bench make_bench(ModelStore& models, const Config& config) {
  const ReducedModel& model = models.reduced();
  Bench bench{.config = config,
              .model = model,
              .observer = observer_model(config),
              .eye = FullOrderPlant(models.plant_full(), config.plant.discretization,
                                    config.control.period, config.plant.absorption()),
              .models = &models,
              .controller = Controller(model, config.control, config.estimator)};
  // "At limit": the first cycle whose plan runs along the limit, or that has reached the reference.
  FaultCase nominal;
  nominal.injection.start = kNominalCycles - kAfter;
  for (const CycleRecord& record : run_one(bench, nominal, Unsupervised{}).records) {
    if (record.decision.limit_active || reached(record.truth.peak, config.control.peak_reference)) {
      bench.at_limit = static_cast<std::uint64_t>(record.cycle);
      break;
    }
  }
  return bench;
}

void run_cases(const Bench& bench, const std::vector<FaultCase>& table, const FaultOptions& options,
               std::vector<FaultRow>& rows) {
  for (const FaultCase& listed : table) {
    const bool open = listed.demand == Demand::kReport;
    const std::vector<double>& periods = open ? options.open_periods : options.periods;
    if (std::find(periods.begin(), periods.end(), bench.config.control.period) == periods.end()) {
      continue;
    }
    const auto row = std::find_if(rows.begin(), rows.end(),
                                  [&](const FaultRow& r) { return r.id == listed.id; });
    if (row == rows.end()) continue;
    std::vector<std::uint64_t> moments = {0, 1, 2, 3, 4, 5, bench.at_limit, kSteady};
    if (listed.demand == Demand::kDone) moments = {kSteady};
    if (open) moments.push_back(10);
    const Fault fault = listed.injection.fault;
    if (fault == Fault::kGains || fault == Fault::kLag) moments = {0};
    for (const std::uint64_t moment : moments) {
      FaultCase test = listed;
      test.injection.start = moment;
      const Recorded run =
          options.supervised
              ? run_one(bench, test, treating(limits_for(bench, test), bench.observer))
              : run_one(bench, test, Unsupervised{});
      add_to(*row, test, judge(bench, test, run), bench.config);
    }
  }
}

}  // namespace

std::vector<FaultRow> run_fault_table(const FaultOptions& options,
                                      const std::function<void(double)>& progress) {
  const std::vector<FaultCase> table = fault_table();
  std::vector<FaultRow> rows;
  for (const FaultCase& test : table) {
    if (!options.only.empty() && test.id != options.only) continue;
    if (rows.empty() || rows.back().id != test.id)
      rows.push_back({.id = test.id, .first_failure = {}, .peak_at = {}});
  }
  std::vector<double> periods = options.periods;
  for (const double period : options.open_periods) {
    if (std::find(periods.begin(), periods.end(), period) == periods.end()) {
      periods.push_back(period);
    }
  }
  const std::size_t benches =
      periods.size() * options.delays.size() * options.absorptions.size() * options.horizons.size();
  std::size_t done = 0;
  for (const double period : periods) {
    std::vector<std::string> overrides = options.overrides;
    for (const std::string& setting : {std::string("safety.real_time=enforce"),
                                       fmt::format("control.period_ms={}", period * 1e3),
                                       fmt::format("grid.min_cells={}", options.min_cells)}) {
      overrides.push_back(setting);
    }
    const Config base = load_config("", overrides);
    ModelStore models(base, true);
    for (const int delay : options.delays) {
      for (const double alpha : options.absorptions) {
        for (const int horizon : options.horizons) {
          if (progress) progress(static_cast<double>(done++) / static_cast<double>(benches));
          Config config = base;
          config.plant.absorption_factor = alpha;
          config.control.horizon = horizon;
          config.control.delay = delay;
          run_cases(make_bench(models, config), table, options, rows);
        }
      }
    }
  }
  return rows;
}

FalseStops count_false_stops(int treatments, std::size_t min_cells,
                             const std::function<void(double)>& progress) {
  FalseStops count;
  Config config =
      load_config("", {"safety.real_time=enforce", fmt::format("grid.min_cells={}", min_cells)});
  ModelStore models(config, true);
  Bench bench = make_bench(models, config);
  FaultCase healthy;
  healthy.injection.start = config.cycles() - kAfter;
  for (int i = 0; i < treatments; ++i) {
    if (progress) progress(static_cast<double>(i) / treatments);
    const auto draw = static_cast<std::uint64_t>(i);
    const double alpha = 0.35 + (1.5 - 0.35) * uniform(77, draw, RandomStream::kTest);
    bench.config.plant.absorption_factor = alpha;
    bench.config.run.seed = draw + 1;
    bench.eye = FullOrderPlant(models.plant_full(), config.plant.discretization,
                               config.control.period, {alpha, config.plant.choroid_factor});
    const Recorded run =
        run_one(bench, healthy, treating(safety_limits(bench.config), bench.observer));
    ++count.treatments;
    for (const CycleRecord& record : run.records) {
      count.peak = std::max(count.peak, record.truth.peak);
    }
    if (!run.outcome.stopped) continue;
    ++count.stopped;
    if (count.first_reason.empty()) {
      count.first_reason = fmt::format("{}, alpha {:.3f}, seed {}",
                                       to_string(run.outcome.safety.reason), alpha, draw + 1);
    }
  }
  return count;
}

}  // namespace photocoag
