#include "photocoag/run/treatment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/stepper.hpp"
#if PHOTOCOAG_HAS_OSQP
#include "photocoag/osqp/sparse.hpp"
#endif
#include "photocoag/rt/clock_pace.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {
namespace {

// Samples of the cold eye at 0 W and a trip of its watchdog, on a copy of the eye: the treatment
// starts from cold tissue whatever the test did.
template <Plant P>
SelfTestReport self_test(SimulatedEye<P> eye, int delay) {
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
  report.log_has_room = true;  // the records' memory is there
  return report;
}

SelfTestReport passed_self_test(const Config& config) {
  return {.samples = 64,
          .sigma = config.plant.noise,
          .watchdog_tripped = true,
          .model_matches = true,
          .solver_exact = true,
          .log_has_room = true};
}

template <Controlling C, Plant P, Supervision S>
void run_under(S& supervisor, const Config& config, C& controller, SimulatedEye<P>& eye,
               Pacing pacing, const std::atomic<bool>& stop, std::atomic<std::size_t>& progress,
               Treatment& treatment) {
  const double period = config.control.period;
  const auto begin = std::chrono::steady_clock::now();
  if (pacing == Pacing::kVirtualTime) {
    VirtualPace pace(stop);
    PacedEye device(eye, pace, period);
    treatment.outcome =
        run_loop(controller, device, supervisor, period, treatment.records, progress);
  } else {
    ClockPace pace(period, treatment.records.size(), stop);
    PacedEye device(eye, pace, period);
    std::thread loop([&] {
      treatment.scheduling = request_real_time().describe();
      pace.start();
      treatment.outcome =
          run_loop(controller, device, supervisor, period, treatment.records, progress);
    });
    loop.join();
    treatment.timing = pace.timing();
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  treatment.wall_seconds = wall.count();
  treatment.records.resize(treatment.outcome.cycles);
}

template <Controlling C, Plant P>
void run(const Config& config, const ReducedModel& model, C& controller, P plant,
         const EyeOptions& options, Pacing pacing, const std::atomic<bool>& stop,
         std::atomic<std::size_t>& progress, Treatment& treatment) {
  const SimulatedEye<P> cold(plant, config.plant.noise, config.run.seed,
                             {.delay = config.control.delay});
  SimulatedEye<P> eye(
      std::move(plant), config.plant.noise, config.run.seed,
      {.delay = options.delay.value_or(config.control.delay),
       .dark_is_silent = config.plant.zero_power_sample == ZeroPowerSample::kMissing,
       .sensor_gain = options.sensor_gain,
       .sensor_offset = options.sensor_offset});
  if (!config.safety.supervised) {
    Unsupervised none;
    return run_under(none, config, controller, eye, pacing, stop, progress, treatment);
  }
  Supervisor supervisor(safety_limits(config), witness_model(model, config.estimator));
  supervisor.power_on();
  const SelfTestReport report =
      options.self_test ? self_test(cold, config.control.delay) : passed_self_test(config);
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
  run_under(supervisor, config, controller, eye, pacing, stop, progress, treatment);
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
Treatment treat_with(const Config& config, const ReducedModel& model, const EyeModel& eye,
                     const EyeOptions& options, Pacing pacing, const std::atomic<bool>& stop,
                     std::atomic<std::size_t>& progress) {
  // A dummy cycle, then a new controller in the same place: the treatment's first cycle finds code
  // and memory warm.
  std::optional<BasicController<M>> place;
  place.emplace(model, config.control, config.estimator);
  place->decide();
  place->step({.volume_temperature = 0.0, .applied_power = 0.0});
  BasicController<M>& controller = place.emplace(model, config.control, config.estimator);
  if (options.first_power) controller.start_with(*options.first_power);
  Treatment treatment;
  treatment.records.resize(config.cycles());
  if (eye.full) {
    treatment.full_order_states = eye.full->states();
    run(config, model, controller,
        FullOrderPlant(eye.full, config.plant.discretization, config.control.period,
                       config.plant.absorption()),
        options, pacing, stop, progress, treatment);
  } else {
    treatment.full_order_states = eye.reduced->full_order_states;
    run(config, model, controller, ReducedPlant(*eye.reduced, config.plant.absorption()),
        options, pacing, stop, progress, treatment);
  }
  return treatment;
}

Treatment treat(const Config& config, const ReducedModel& model, const EyeModel& eye,
                const EyeOptions& options, Pacing pacing, const std::atomic<bool>& stop,
                std::atomic<std::size_t>& progress) {
#if PHOTOCOAG_HAS_OSQP
  if (config.control.solver == SolverKind::kOsqp) {
    return treat_with<SparseOsqpController>(config, model, eye, options, pacing, stop, progress);
  }
  if (config.control.solver == SolverKind::kOsqpCondensed) {
    return treat_with<CondensedOsqpController>(config, model, eye, options, pacing, stop, progress);
  }
#endif
  if (config.control.solver != SolverKind::kDense) {
    throw Error({.key = "control.solver",
                 .problem = "this build has no OSQP",
                 .found = "a solver that needs it",
                 .accepted = "dense"});
  }
  return treat_with<ModelPredictiveController<DenseSolver>>(config, model, eye, options, pacing,
                                                            stop, progress);
}

}  // namespace

Treatment run_treatment(const Config& config, ModelStore& models, Pacing pacing,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress) {
  const ReducedModel& model = models.reduced();
  if (config.plant.model == PlantModel::kFull) {
    return treat(config, model, {.full = models.plant_full()}, {}, pacing, stop, progress);
  }
  const ReducedModel plant = models.plant_reduced();
  return treat(config, model, {.full = nullptr, .reduced = &plant}, {}, pacing, stop, progress);
}

Treatment simulate_eye(const Config& config, const ReducedModel& model, const EyeModel& eye,
                       const EyeOptions& options) {
  const std::atomic<bool> never{false};
  std::atomic<std::size_t> progress{0};
  return treat(config, model, eye, options, Pacing::kVirtualTime, never, progress);
}

}  // namespace photocoag
