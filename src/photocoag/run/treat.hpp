// Role: the program; the one pipeline of all treatments, whatever the device: controller,
// self-test, supervisor, loop, and what is measured of it. Used by run. Source:
// docs/architecture.md.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>

#include "photocoag/core/error.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#if PHOTOCOAG_HAS_OSQP
#include "photocoag/osqp/sparse.hpp"
#endif
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/observer.hpp"
#include "photocoag/run/open_device.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// What every treatment gets from its caller; nothing is needed.
struct LoopContext {
  Watch watch = {};
  Onlooker onlooker = {};

  bool log_is_good() const noexcept { return watch.log == nullptr || watch.log->healthy(); }
};

/// The closed loop on this thread: `treatment` gets as many records as it has room for.
template <Controlling C, OpenDevice O, Supervision S>
void close_loop(const Config& config, C& controller, O& open, S& supervisor,
                const LoopContext& context, Treatment& treatment) {
  const double period = config.control.period;
  const std::size_t cycles = treatment.records.size();
  Watch watch = context.watch;
  watch.live = context.onlooker.live;
  watch.goal = GoalWatch(config);
  TreatmentObserver observer(period, open.timed() ? cycles : 0, watch);
  open.begin(cycles);
  const auto begin = std::chrono::steady_clock::now();
  const PageFaults before = page_faults();
  treatment.outcome = run_loop(controller, open.device(), supervisor, period,
                               std::span(treatment.records), observer);
  treatment.page_faults = page_faults() - before;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  treatment.wall_seconds = wall.count();
  if (open.timed()) treatment.histograms = observer.histograms();
  treatment.timing = observer.timing();
  treatment.goal = observer.goal();
  treatment.records.resize(treatment.outcome.cycles);
}

/// Self-test, supervisor, loop. Throws O::Refusal before the loop only.
template <Controlling C, OpenDevice O>
void treat_with(const Config& config, C& controller, O& open, const LoopContext& context,
                Treatment& treatment) {
  if (!config.safety.supervised) {
    open.self_test(context.log_is_good());  // nobody looks, but the device has shown what it does
    Unsupervised none;
    close_loop(config, controller, open, none, context, treatment);
  } else {
    const SafetyLimits limits = open.limits();
    const ObserverModel observer = open.observer();  // takes its time, which no device waits for
    const SelfTestReport report = open.self_test(context.log_is_good());
    if (context.onlooker.self_tested) context.onlooker.self_tested(report, limits);
    auto supervisor = begun_supervisor<typename O::Refusal>(limits, observer, report);
    close_loop(config, controller, open, supervisor, context, treatment);
  }
  open.finish(treatment);
}

/// use(controller) with one that has warmed up: a dummy cycle, then a new controller in the same
/// place, so that the treatment's first cycle finds code and memory warm.
template <PredictiveController M, typename Use>
void with_warm(const Config& config, const ReducedModel& model, Use use) {
  std::optional<BasicController<M>> place;
  place.emplace(model, config.control, config.estimator);
  place->decide();
  place->step({.volume_temperature = 0.0, .applied_power = 0.0});
  use(place.emplace(model, config.control, config.estimator));
}

/// One treatment on a device that is open, with the configuration's controller. Throws Error before
/// the loop only.
template <OpenDevice O>
void treat(const Config& config, O& open, const LoopContext& context, Treatment& treatment) {
  const auto use = [&](auto& controller) {
    treat_with(config, controller, open, context, treatment);
    treatment.prior_check = prior_check_of(controller.filter());
  };
#if PHOTOCOAG_HAS_OSQP
  if constexpr (O::kAnySolver) {
    if (config.control.solver == SolverKind::kOsqp) {
      return with_warm<SparseOsqpController>(config, open.model(), use);
    }
    if (config.control.solver == SolverKind::kOsqpCondensed) {
      return with_warm<CondensedOsqpController>(config, open.model(), use);
    }
  }
#endif
  if (O::kAnySolver && config.control.solver != SolverKind::kDense) {
    throw Error({.key = "control.solver",
                 .problem = "this build has no OSQP",
                 .found = "a solver that needs it",
                 .accepted = "dense"});
  }
  with_warm<ModelPredictiveController<DenseSolver>>(config, open.model(), use);
}

}  // namespace photocoag
