#include "photocoag/run/treatment.hpp"

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

namespace photocoag {
namespace {

template <PredictiveController M, Plant P>
void run(const Config& config, BasicController<M>& controller, P plant, Pacing pacing,
         const std::atomic<bool>& stop, std::atomic<std::size_t>& progress, Treatment& treatment) {
  SimulatedEye<P> eye(
      std::move(plant), config.plant.noise, config.run.seed,
      {.delay = config.control.delay,
       .dark_is_silent = config.plant.zero_power_sample == ZeroPowerSample::kMissing});
  const double period = config.control.period;
  const auto begin = std::chrono::steady_clock::now();
  if (pacing == Pacing::kVirtualTime) {
    VirtualPace pace(stop);
    treatment.outcome = run_loop(controller, eye, pace, period, treatment.records, progress);
  } else {
    ClockPace pace(period, treatment.records.size(), stop);
    std::thread loop([&] {
      treatment.scheduling = request_real_time().describe();
      pace.start();
      treatment.outcome = run_loop(controller, eye, pace, period, treatment.records, progress);
    });
    loop.join();
    treatment.timing = pace.timing();
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  treatment.wall_seconds = wall.count();
  treatment.records.resize(treatment.outcome.cycles);
}

template <PredictiveController M>
Treatment treat_with(const Config& config, ModelStore& models, Pacing pacing,
                     const std::atomic<bool>& stop, std::atomic<std::size_t>& progress) {
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
    run(config, controller,
        FullOrderPlant(full, config.plant.discretization, config.control.period,
                       config.plant.absorption_factor),
        pacing, stop, progress, treatment);
  } else {
    treatment.full_order_states = model.full_order_states;
    run(config, controller, ReducedPlant(models.plant_reduced(), config.plant.absorption_factor),
        pacing, stop, progress, treatment);
  }
  return treatment;
}

}  // namespace

Treatment run_treatment(const Config& config, ModelStore& models, Pacing pacing,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress) {
#if PHOTOCOAG_HAS_OSQP
  if (config.control.solver == SolverKind::kOsqp) {
    return treat_with<SparseOsqpController>(config, models, pacing, stop, progress);
  }
  if (config.control.solver == SolverKind::kOsqpCondensed) {
    return treat_with<CondensedOsqpController>(config, models, pacing, stop, progress);
  }
#endif
  if (config.control.solver != SolverKind::kDense) {
    throw Error({.key = "control.solver",
                 .problem = "this build has no OSQP",
                 .found = "a solver that needs it",
                 .accepted = "dense"});
  }
  return treat_with<ModelPredictiveController<DenseSolver>>(config, models, pacing, stop, progress);
}

}  // namespace photocoag
