#include "photocoag/run/treatment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/fom/stepper.hpp"
#if PHOTOCOAG_HAS_OSQP
#include "photocoag/osqp/sparse.hpp"
#endif
#include "photocoag/rom/file.hpp"
#include "photocoag/rt/clock_pace.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {
namespace {

// Samples of the cold eye at 0 W and a trip of its watchdog, on a copy of the eye: the treatment
// starts from cold tissue whatever the test did.
template <Plant P>
SelfTestReport self_test(SimulatedEye<P> eye, int delay, bool log_has_room) {
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

/// What every treatment gets from its caller.
struct Surroundings {
  Pacing pacing;
  const std::atomic<bool>& stop;
  std::atomic<std::size_t>& progress;
  LogWriter* log;  ///< may be null
};

template <Controlling C, Plant P, Supervision S>
void run_under(S& supervisor, const Config& config, C& controller, SimulatedEye<P>& eye,
               const Surroundings& around, Treatment& treatment) {
  const double period = config.control.period;
  auto& [pacing, stop, progress, log] = around;
  TreatmentObserver observer(period, pacing == Pacing::kClock, log, GoalWatch(config));
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
    std::thread loop([&] {
      granted = request_real_time();
      pace.start();
      treatment.outcome = run_loop(controller, device, supervisor, period,
                                   std::span(treatment.records), progress, observer);
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
void run(const Config& config, const ReducedModel& model, C& controller, P plant,
         const Surroundings& around, Treatment& treatment) {
  EyeTiming timing{.delay = config.control.delay};
  const SimulatedEye<P> cold(plant, config.plant.noise, config.run.seed, timing);
  timing.dark_is_silent = config.plant.zero_power_sample == ZeroPowerSample::kMissing;
  SimulatedEye<P> eye(std::move(plant), config.plant.noise, config.run.seed, timing);
  if (!config.safety.supervised) {
    Unsupervised none;
    return run_under(none, config, controller, eye, around, treatment);
  }
  Supervisor supervisor(safety_limits(config), witness_model(model, config.estimator.absorption_min,
                                                             config.estimator.absorption_max));
  supervisor.power_on();
  const SelfTestReport report = self_test(
      cold, config.control.delay, around.log == nullptr || around.log->healthy());
  if (!supervisor.finish_self_test(report) || !supervisor.ready() || !supervisor.begin(true)) {
    throw Error(ErrorParts{
        .where = "self-test",
        .problem = "the device is not ready",
        .found = fmt::format("mean {:.3f} K, standard deviation {:.3f} K of {} samples at 0 W; "
                             "{:g} W read back; watchdog {}",
                             report.mean, report.sigma, report.samples, report.power_at_zero,
                             report.watchdog_tripped ? "good" : "does not trip"),
        .accepted = fmt::format("docs/safety.md, for {:g} K calibrated", config.plant.noise)});
  }
  run_under(supervisor, config, controller, eye, around, treatment);
}

}  // namespace

void require_real_time(const Config& config) {
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

template <PredictiveController M>
Treatment treat_with(const Config& config, ModelStore& models, const Surroundings& around) {
  const ReducedModel& model = models.reduced();
  // A dummy cycle, then a new controller in the same place: the treatment's first cycle finds code
  // and memory warm.
  std::optional<BasicController<M>> place;
  place.emplace(model, config.control, config.estimator);
  place->decide();
  place->step({.volume_temperature = 0.0, .applied_power = 0.0});
  BasicController<M>& controller = place.emplace(model, config.control, config.estimator);
  Treatment treatment;
  treatment.records.resize(config.cycles());
  if (config.plant.model == PlantModel::kFull) {
    const auto full = models.plant_full();
    treatment.full_order_states = full->states();
    run(config, model, controller,
        FullOrderPlant(full, config.plant.discretization, config.control.period,
                       config.plant.absorption_factor),
        around, treatment);
  } else {
    treatment.full_order_states = model.full_order_states;
    run(config, model, controller,
        ReducedPlant(models.plant_reduced(), config.plant.absorption_factor), around, treatment);
  }
  return treatment;
}

LogHeader log_header(const Config& config, ModelStore& models) {
  const std::size_t states = config.plant.model == PlantModel::kFull
                                 ? models.plant_full()->states()
                                 : models.reduced().full_order_states;
  return {.program = fmt::format("photocoag {} {}", version(), source_hash()),
          .config_sha256 = config_sha256(models.config()),
          .model_sha256 = sha256_hex(to_json(models.reduced())),
          .period = config.control.period,
          .planned_cycles = static_cast<std::int64_t>(config.cycles()),
          .full_order_states = static_cast<std::int64_t>(states),
          .fields = {}};
}

Treatment treat_with_solver(const Config& config, ModelStore& models, const Surroundings& around) {
#if PHOTOCOAG_HAS_OSQP
  if (config.control.solver == SolverKind::kOsqp) {
    return treat_with<SparseOsqpController>(config, models, around);
  }
  if (config.control.solver == SolverKind::kOsqpCondensed) {
    return treat_with<CondensedOsqpController>(config, models, around);
  }
#endif
  if (config.control.solver != SolverKind::kDense) {
    throw Error({.key = "control.solver",
                 .problem = "this build has no OSQP",
                 .found = "a solver that needs it",
                 .accepted = "dense"});
  }
  return treat_with<ModelPredictiveController<DenseSolver>>(config, models, around);
}

}  // namespace

Treatment run_treatment(const Config& config, ModelStore& models, Pacing pacing,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress,
                        const std::filesystem::path& log_folder, LogOptions log_options) {
  if (log_folder.empty()) {
    return treat_with_solver(config, models, {pacing, stop, progress, nullptr});
  }
  if (log_options.ring_records == 0) {
    log_options.ring_records = static_cast<std::size_t>(std::ceil(1.0 / config.control.period));
  }
  LogWriter log(log_folder, log_header(config, models), std::move(log_options));
  const std::uint64_t bytes = 2 * sizeof(LogRecord) * config.cycles();
  if (!disk_has_room(log_folder, bytes)) {
    throw Error(ErrorParts{.where = log_folder.string(),
                           .problem = "the disk has no room for the log",
                           .accepted = fmt::format("{} bytes free", bytes)});
  }
  Treatment treatment = treat_with_solver(config, models, {pacing, stop, progress, &log});
  treatment.log.totals = log.close();
  treatment.log.segments = log.segments();
  treatment.log.trouble = log.trouble();
  return treatment;
}

}  // namespace photocoag
