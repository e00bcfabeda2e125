#include "photocoag/run/treatment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <thread>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/sampled_plant.hpp"
#if PHOTOCOAG_HAS_OSQP
#include "photocoag/osqp/sparse.hpp"
#endif
#include "photocoag/rom/intersample.hpp"
#include "photocoag/rt/clock_pace.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/configured_eye.hpp"
#include "photocoag/run/supervised_loop.hpp"
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

/// What a simulated treatment gets from its caller.
struct Simulation {
  Pacing pacing;
  LoopContext context;
  const PlantMismatch& mismatch;
  const OwnParts& own = kNoOwnParts;

  static inline const OwnParts kNoOwnParts{};
};

const Onlooker kNobody{};

// In virtual time on this thread; paced by the clock on one of its own.
template <Controlling C, Plant P, Supervision S>
void pace_loop(const Config& config, C& controller, P plant, S& supervisor,
               const Simulation& simulation, Treatment& treatment) {
  const double period = config.control.period;
  const LoopContext& context = simulation.context;
  const EyeSettings settings = eye_settings(config, simulation.mismatch);
  if (simulation.pacing == Pacing::kVirtualTime) {
    SimulatedEye device(std::move(plant), config.plant.noise, config.run.seed, settings,
                        VirtualPace(period));
    return close_loop(config, controller, device, supervisor, false, context, treatment);
  }
  SimulatedEye device(std::move(plant), config.plant.noise, config.run.seed, settings,
                      ClockPace(period));
  std::thread([&] {
    treatment.scheduling = request_real_time(config.safety.core).describe();
    device.pace().start();
    close_loop(config, controller, device, supervisor, true, context, treatment);
  }).join();
}

template <Controlling C, Plant P>
void run(const Config& config, C& controller, P plant, const Simulation& simulation,
         Treatment& treatment) {
  const PlantMismatch& mismatch = simulation.mismatch;
  if (!config.safety.supervised) {
    Unsupervised none;
    return pace_loop(config, controller, std::move(plant), none, simulation, treatment);
  }
  const SafetyLimits limits = safety_limits(config);
  const SelfTestReport report = mismatch.self_test
                                    ? self_test_eye(config, simulation.context.log_is_good())
                                    : passed_self_test(config.plant.noise);
  simulation.context.onlooker.tell(report, limits);
  Supervisor supervisor = begun_supervisor(limits, observer_model(config), report);
  pace_loop(config, controller, std::move(plant), supervisor, simulation, treatment);
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
Treatment treat_eye(const Config& config, C& controller, const EyeModel& eye,
                    const Simulation& simulation) {
  Treatment treatment;
  treatment.records.resize(config.cycles());
  if (simulation.own.plant) {
    OwnController any(controller);
    run(config, any, *simulation.own.plant, simulation, treatment);
    return treatment;
  }
  treatment.full_order_states = eye.full ? eye.full->states() : eye.reduced->full_order_states;
  const auto treat = [&](auto plant) {
    run(config, controller, std::move(plant), simulation, treatment);
  };
  if (eye.full && eye.sampled && !config.plant.bench.needs_intersample()) {
    treat(SampledPlant(*eye.full, config.plant.discretization, config.control.period,
                       config.plant.absorption(), config.cycles()));
  } else {
    with_plant(config, eye.full, eye.reduced, treat);
  }
  return treatment;
}

template <PredictiveController M>
Treatment treat_with(const Config& config, const ReducedModel& model, const EyeModel& eye,
                     const Simulation& simulation) {
  // A dummy cycle, then a new controller in the same place: the treatment's first cycle finds code
  // and memory warm.
  std::optional<BasicController<M>> place;
  place.emplace(model, config.control, config.estimator);
  place->decide();
  place->step({.volume_temperature = 0.0, .applied_power = 0.0});
  BasicController<M>& controller = place.emplace(model, config.control, config.estimator);
  Treatment treatment = treat_eye(config, controller, eye, simulation);
  treatment.prior_check = prior_check_of(controller.filter());
  return treatment;
}

Treatment treat(const Config& config, const ReducedModel& plain, const EyeModel& eye,
                const Simulation& simulation) {
  if (simulation.own.controller) {
    OwnController controller = *simulation.own.controller;
    return treat_eye(config, controller, eye, simulation);
  }
  const ReducedModel model = told_of(plain, config.estimator.timing);
#if PHOTOCOAG_HAS_OSQP
  if (config.control.solver == SolverKind::kOsqp) {
    return treat_with<SparseOsqpController>(config, model, eye, simulation);
  }
  if (config.control.solver == SolverKind::kOsqpCondensed) {
    return treat_with<CondensedOsqpController>(config, model, eye, simulation);
  }
#endif
  if (config.control.solver != SolverKind::kDense) {
    throw Error({.key = "control.solver",
                 .problem = "this build has no OSQP",
                 .found = "a solver that needs it",
                 .accepted = "dense"});
  }
  return treat_with<ModelPredictiveController<DenseSolver>>(config, model, eye, simulation);
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
    return treat(config, model, eye, {pacing, {stop, progress, nullptr, onlooker}, as_configured});
  }
  const auto log = start_log(config, models, log_folder, "", std::move(log_options));
  Treatment treatment =
      treat(config, model, eye, {pacing, {stop, progress, log.get(), onlooker}, as_configured});
  treatment.log = finish_log(*log);
  return treatment;
}

Treatment simulate_eye(const Config& config, const ReducedModel& model, const EyeModel& eye,
                       const PlantMismatch& options) {
  const std::atomic<bool> never{false};
  std::atomic<std::size_t> progress{0};
  return treat(config, model, eye,
               {Pacing::kVirtualTime, {never, progress, nullptr, kNobody}, options});
}

Treatment simulate_with(const Config& config, const ReducedModel& model, const EyeModel& eye,
                        const OwnParts& own, const std::atomic<bool>& stop,
                        std::atomic<std::size_t>& progress) {
  const PlantMismatch as_configured;
  return treat(config, model, eye,
               {Pacing::kVirtualTime, {stop, progress, nullptr, kNobody}, as_configured, own});
}

}  // namespace photocoag
