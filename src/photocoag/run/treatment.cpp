#include "photocoag/run/treatment.hpp"

#include <chrono>
#include <thread>

#include "photocoag/fom/stepper.hpp"
#include "photocoag/rt/clock_pace.hpp"
#include "photocoag/rt/real_time.hpp"

namespace photocoag {
namespace {

template <Plant P>
void run(const Config& config, Controller& controller, P plant, Pacing pacing,
         const std::atomic<bool>& stop, std::atomic<std::size_t>& progress, Treatment& treatment) {
  SimulatedEye<P> eye(std::move(plant), config.plant.noise, config.run.seed);
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

}  // namespace

Treatment run_treatment(const Config& config, ModelStore& models, Pacing pacing,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress) {
  const ReducedModel& model = models.reduced();
  Controller controller(model, config.control, config.estimator);
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

}  // namespace photocoag
