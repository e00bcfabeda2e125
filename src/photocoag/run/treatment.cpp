#include "photocoag/run/treatment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/intersample_plant.hpp"
#include "photocoag/fom/stepper.hpp"
#if PHOTOCOAG_HAS_OSQP
#include "photocoag/osqp/sparse.hpp"
#endif
#include "photocoag/rom/intersample.hpp"
#include "photocoag/rt/clock_pace.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/treatment_log.hpp"

namespace photocoag {
namespace {

// Tissue that nothing heats.
struct ColdPlant {
  void step(double) noexcept {}
  Outputs outputs() const noexcept { return {}; }
};

}  // namespace

// Not on the treatment's own tissue, which stays cold whatever the test does.
SelfTestReport self_test_eye(const Config& config, bool log_has_room) {
  const int delay = config.control.delay;
  SimulatedEye<ColdPlant> eye({}, config.plant.noise, config.run.seed, {.delay = delay});
  constexpr std::uint64_t kNever = std::uint64_t{1} << 40;  // noise that no treatment draws
  constexpr std::uint64_t kSamples = 64;
  std::vector<double> baseline;
  double power_at_zero = 0.0;
  for (std::uint64_t k = 0; k < kSamples; ++k) {
    eye.write(0.0);
    const Sample sample = eye.advance(kNever + k).sample;
    baseline.push_back(sample.volume_temperature);
    power_at_zero = std::max(power_at_zero, sample.applied_power);
  }
  SelfTestReport report = self_test_of(baseline);
  report.power_at_zero = power_at_zero;
  eye.write(1e-3);
  double power = 0.0;
  for (int k = 0; k < 3 + delay; ++k) power = eye.advance(kNever).sample.applied_power;
  report.watchdog_tripped = power == 0.0;
  report.model_matches = true;  // ModelStore has refused any other
  report.solver_exact = solver_is_exact();
  report.log_has_room = log_has_room;
  return report;
}

namespace {

/// What every loop gets from its caller.
struct LoopContext {
  Pacing pacing;
  const std::atomic<bool>& stop;
  std::atomic<std::size_t>& progress;
  LogWriter* log;  ///< may be null
  const PlantMismatch& eye;
  const Onlooker& onlooker = kNobody;
  const OwnParts& own = kNoOwnParts;

  static inline const Onlooker kNobody{};
  static inline const OwnParts kNoOwnParts{};
};

template <Controlling C, Plant P, Supervision S>
void run_under(S& supervisor, const Config& config, C& controller, SimulatedEye<P>& eye,
               const LoopContext& around, Treatment& treatment) {
  const double period = config.control.period;
  auto& [pacing, stop, progress, log, options, onlooker, own] = around;
  TreatmentObserver observer(period, pacing == Pacing::kClock, log, GoalWatch(config),
                             onlooker.live);
  const auto begin = std::chrono::steady_clock::now();
  if (pacing == Pacing::kVirtualTime) {
    VirtualPace pace(stop);
    PacedEye device(eye, pace, period);
    treatment.outcome = run_loop(controller, device, supervisor, period,
                                 std::span(treatment.records), progress, observer);
  } else {
    ClockPace pace(period, treatment.records.size(), stop);
    PacedEye device(eye, pace, period);
    RealTime granted;
    std::thread loop([&, &done = progress] {
      granted = request_real_time(config.safety.core);
      const PageFaults before = page_faults();
      pace.start();
      treatment.outcome = run_loop(controller, device, supervisor, period,
                                   std::span(treatment.records), done, observer);
      treatment.page_faults = page_faults() - before;
    });
    loop.join();
    treatment.scheduling = granted.describe();
    treatment.timing = pace.timing();
    treatment.histograms = observer.histograms();
  }
  treatment.goal = observer.goal();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  treatment.wall_seconds = wall.count();
  treatment.records.resize(treatment.outcome.cycles);
}

template <Controlling C, Plant P>
void run(const Config& config, C& controller, P plant, const LoopContext& around,
         Treatment& treatment) {
  SimulatedEye<P> eye(
      std::move(plant), config.plant.noise, config.run.seed,
      {.delay = around.eye.delay.value_or(config.control.delay),
       .dark_is_silent = config.plant.zero_power_sample == ZeroPowerSample::kMissing,
       .sensor_gain = config.plant.bench.sample_gain * around.eye.sensor_gain,
       .sensor_offset = around.eye.sensor_offset,
       .power_gain = config.plant.bench.power_gain,
       .power_lag = config.plant.bench.timing.power_lag,
       .readback = config.plant.bench.readback == PowerReadback::kEmitted});
  if (!config.safety.supervised) {
    Unsupervised none;
    return run_under(none, config, controller, eye, around, treatment);
  }
  const SafetyLimits limits = safety_limits(config);
  Supervisor supervisor(limits, observer_model(config));
  supervisor.power_on();
  const bool log_is_good = around.log == nullptr || around.log->healthy();
  const SelfTestReport report = around.eye.self_test ? self_test_eye(config, log_is_good)
                                                     : passed_self_test(config.plant.noise);
  around.onlooker.tell(report, limits);
  if (!supervisor.finish_self_test(report) || !supervisor.ready() || !supervisor.begin(true)) {
    throw Error(not_ready(report, limits));
  }
  run_under(supervisor, config, controller, eye, around, treatment);
}

}  // namespace

void require_real_time(const Config& config) {
  const int core = config.safety.core;
  bool may_run = true;
  std::thread([&] { may_run = core == kAnyCore || pin_to_core(core); }).join();
  if (!may_run) {
    throw Error(ErrorParts{.key = "safety.core",
                           .problem = "the loop may not run on that core",
                           .found = fmt::format("{}", core),
                           .accepted = allowed_cores() + ", or -1"});
  }
  if (config.safety.real_time != RealTimeMode::kEnforce) return;
  RealTime granted;
  std::thread([&granted] { granted = request_real_time(); }).join();
  if (granted.fifo_priority && granted.locked_memory) return;
  throw Error(ErrorParts{.where = "real time",
                         .key = "safety.real_time",
                         .problem = "this machine does not grant what \"enforce\" needs",
                         .found = granted.describe(),
                         .accepted = "SCHED_FIFO and locked memory (limits rtprio and memlock), or "
                                     "\"observe\" with a simulated eye"});
}

namespace {

// On the eye that is there: one's own, the full-order one, the reduced one.
template <Controlling C>
Treatment close_loop(const Config& config, C& controller, const EyeModel& eye,
                     const LoopContext& around) {
  Treatment treatment;
  treatment.records.resize(config.cycles());
  if (around.own.plant) {
    OwnController any(controller);
    run(config, any, *around.own.plant, around, treatment);
    return treatment;
  }
  treatment.full_order_states = eye.full ? eye.full->states() : eye.reduced->full_order_states;
  const PlantSettings& plant = config.plant;
  const BenchSettings& bench = plant.bench;
  const auto treat_eye = [&](auto simulated) {
    run(config, controller, std::move(simulated), around, treatment);
  };
  if (bench.needs_intersample() && eye.full) {
    treat_eye(IntersamplePlant(eye.full, config.control.period, plant.absorption(), bench.timing,
                               bench.absorption_drift));
  } else if (bench.needs_intersample()) {
    treat_eye(ReducedIntersamplePlant(*eye.reduced, plant.absorption(), bench.timing,
                                      bench.absorption_drift));
  } else if (eye.full) {
    treat_eye(
        FullOrderPlant(eye.full, plant.discretization, config.control.period, plant.absorption()));
  } else {
    treat_eye(ReducedPlant(*eye.reduced, plant.absorption()));
  }
  return treatment;
}

template <PredictiveController M>
Treatment treat_with(const Config& config, const ReducedModel& model, const EyeModel& eye,
                     const LoopContext& around) {
  // A dummy cycle, then a new controller in the same place: the treatment's first cycle finds code
  // and memory warm.
  std::optional<BasicController<M>> place;
  place.emplace(model, config.control, config.estimator);
  place->decide();
  place->step({.volume_temperature = 0.0, .applied_power = 0.0});
  BasicController<M>& controller = place.emplace(model, config.control, config.estimator);
  Treatment treatment = close_loop(config, controller, eye, around);
  treatment.prior_check = prior_check_of(controller.filter());
  return treatment;
}

Treatment treat(const Config& config, const ReducedModel& plain, const EyeModel& eye,
                const LoopContext& around) {
  if (around.own.controller) {
    OwnController controller = *around.own.controller;
    return close_loop(config, controller, eye, around);
  }
  const ReducedModel model = told_of(plain, config.estimator.timing);
#if PHOTOCOAG_HAS_OSQP
  if (config.control.solver == SolverKind::kOsqp) {
    return treat_with<SparseOsqpController>(config, model, eye, around);
  }
  if (config.control.solver == SolverKind::kOsqpCondensed) {
    return treat_with<CondensedOsqpController>(config, model, eye, around);
  }
#endif
  if (config.control.solver != SolverKind::kDense) {
    throw Error({.key = "control.solver",
                 .problem = "this build has no OSQP",
                 .found = "a solver that needs it",
                 .accepted = "dense"});
  }
  return treat_with<ModelPredictiveController<DenseSolver>>(config, model, eye, around);
}

}  // namespace

Treatment run_treatment(const Config& config, ModelStore& models, Pacing pacing,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress,
                        const std::filesystem::path& log_folder, LogOptions log_options,
                        const Onlooker& onlooker) {
  if (config.photoacoustics.sampling == Sampling::kPulses) {
    throw Error(ErrorParts{.key = "photoacoustics.sampling",
                           .problem = "the eye in this process has no pulses",
                           .found = "pulses",
                           .accepted = "instant, or treat --device eye"});
  }
  const ReducedModel& model = models.reduced();
  const PlantMismatch as_configured;
  std::optional<ReducedModel> plant;
  EyeModel eye;
  if (config.plant.model == PlantModel::kFull) {
    eye.full = models.plant_full();
  } else {
    eye.reduced = &plant.emplace(models.plant_reduced());
  }
  if (log_folder.empty()) {
    return treat(config, model, eye, {pacing, stop, progress, nullptr, as_configured, onlooker});
  }
  const auto log = start_log(config, models, log_folder, "", std::move(log_options));
  Treatment treatment =
      treat(config, model, eye, {pacing, stop, progress, log.get(), as_configured, onlooker});
  treatment.log = finish_log(*log);
  return treatment;
}

Treatment simulate_eye(const Config& config, const ReducedModel& model, const EyeModel& eye,
                       const PlantMismatch& options) {
  const std::atomic<bool> never{false};
  std::atomic<std::size_t> progress{0};
  return treat(config, model, eye, {Pacing::kVirtualTime, never, progress, nullptr, options});
}

Treatment simulate_with(const Config& config, const ReducedModel& model, const EyeModel& eye,
                        const OwnParts& own, const std::atomic<bool>& stop,
                        std::atomic<std::size_t>& progress) {
  const PlantMismatch as_configured;
  return treat(
      config, model, eye,
      {Pacing::kVirtualTime, stop, progress, nullptr, as_configured, LoopContext::kNobody, own});
}

}  // namespace photocoag
