#include "photocoag/study/timing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <numeric>

#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#if PHOTOCOAG_HAS_OSQP
#include "photocoag/osqp/sparse.hpp"
#endif

namespace photocoag {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kRepetitions = 5;
#if PHOTOCOAG_HAS_OSQP
constexpr const char* kSolvers[] = {"dense", "osqp"};
#else
constexpr const char* kSolvers[] = {"dense"};
#endif

// What the controller knew before each decision.
struct Decided {
  StateVector state;
  StateVector input;
  double previous_power;
};

std::vector<Decided> record(const Config& config, const EyeModels& models, std::uint64_t seed) {
  Controller controller(models.reduced, config.control, config.estimator);
  SimulatedEye eye(FullOrderPlant(models.full, config.plant.discretization, config.control.period,
                                  config.plant.absorption()),
                   config.plant.noise, seed, {.delay = config.control.delay});
  std::vector<Decided> all;
  double previous = 0.0;
  for (std::size_t cycle = 0; cycle < config.cycles(); ++cycle) {
    all.push_back({controller.filter().state(), controller.filter().matrices().input, previous});
    const Decision decision = controller.decide();
    eye.write(decision.power);
    const Reading reading = eye.advance(cycle);
    controller.observe(reading.sample);
    previous = reading.sample.applied_power;
  }
  return all;
}

template <typename Mpc>
void time_once(const Config& config, const ReducedModel& model, const std::vector<Decided>& loop,
               RunResult& result) {
  double unused = 0.0;
  std::vector<double> all;
  std::vector<double> least(loop.size(), std::numeric_limits<double>::infinity());
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    Mpc mpc(model, config.control);
    for (std::size_t n = 0; n < loop.size(); ++n) {
      const auto begin = Clock::now();
      unused +=
          mpc.solve(loop[n].state, loop[n].input, static_cast<long long>(n), loop[n].previous_power)
              .power;
      all.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
      least[n] = std::min(least[n], all.back());
    }
  }
  if (!(unused >= 0.0)) return;  // keeps the solves from being optimised away
  result.measures["solve_mean_us"].push_back(std::accumulate(all.begin(), all.end(), 0.0) /
                                             static_cast<double>(all.size()));
  result.measures["solve_max_us"].push_back(*std::max_element(all.begin(), all.end()));
  result.measures["solve_worst_us"].push_back(*std::max_element(least.begin(), least.end()));
  result.measures["solve_warm_worst_us"].push_back(
      *std::max_element(least.begin() + 1, least.end()));
  result.measures["solve_first_us"].push_back(least.front());
}

#if PHOTOCOAG_HAS_OSQP
// As in the paper: the first solve has nothing to start from.
struct UnpreparedOsqp : SparseOsqpController {
  UnpreparedOsqp(const ReducedModel& model, const ControlSettings& settings)
      : SparseOsqpController(model, settings, SparseForm::kUnprepared) {}
};
#endif

}  // namespace

std::vector<RunResult> time_solvers(const Study& study, int treatments, ModelPool& pool) {
  std::vector<RunResult> results;
  for (const int horizon : study.horizons) {
    std::vector<std::string> set = study.set;
    set.push_back(fmt::format("control.horizon={}", horizon));
    const Config config = load_config(study.base, set);
    for (const char* solver : kSolvers) {
      results.push_back({.id = fmt::format("{}_n{}", solver, horizon),
                         .config = config,
                         .trajectories = {},
                         .measures = {}});
    }
  }
  for (int treatment = 0; treatment < treatments; ++treatment) {
    for (RunResult& result : results) {
      const auto models = pool.get(result.config);
      const std::vector<Decided> loop = record(
          result.config, *models, result.config.run.seed + static_cast<std::uint64_t>(treatment));
#if PHOTOCOAG_HAS_OSQP
      if (result.id.starts_with("osqp")) {
        time_once<UnpreparedOsqp>(result.config, models->reduced, loop, result);
        continue;
      }
#endif
      time_once<ModelPredictiveController<DenseSolver>>(result.config, models->reduced, loop,
                                                        result);
    }
  }
  return results;
}

PaperTime paper_time(int horizon) {
  switch (horizon) {
    case 2:
      return {0.06, 0.12};
    case 5:
      return {0.16, 0.34};
    case 10:
      return {0.29, 0.59};
    case 15:
      return {0.37, 0.65};
    case 20:
      return {0.41, 0.67};
    default:
      return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  }
}

}  // namespace photocoag
