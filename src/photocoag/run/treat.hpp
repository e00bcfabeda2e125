// Role: the program; the pipeline of all treatments on any device: controller, self-test,
// supervisor, loop, measurements of the loop. Used by run. Source: docs/architecture.md.
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

/// What a caller may pass to a treatment.
struct LoopContext {
  Watch watch = {};
  TreatmentMonitor monitor = {};

  bool log_is_good() const noexcept { return watch.log == nullptr || watch.log->healthy(); }
};

/// Runs the closed loop on this thread; treatment.records is allocated by the caller and limits the
/// number of cycles.
template <Controlling C, OpenDevice O, Supervision S>
void close_loop(const Config& config, C& controller, O& open, S& supervisor,
                const LoopContext& context, Treatment& treatment) {
  const double period = config.control.period;
  const std::size_t cycles = treatment.records.size();
  Watch watch = context.watch;
  watch.live = context.monitor.live;
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

/// Self-test, supervisor, loop. Throws O::Refusal only before the loop.
template <Controlling C, OpenDevice O>
void treat_with(const Config& config, C& controller, O& open, const LoopContext& context,
                Treatment& treatment) {
  if (!config.safety.supervised) {
    open.self_test(
        context
            .log_is_good());  // the report is ignored, but the device goes through the same steps
    Unsupervised none;
    close_loop(config, controller, open, none, context, treatment);
  } else {
    const SafetyLimits limits = open.limits();
    const ObserverModel observer = open.observer();  // may take long: before the device is used
    const SelfTestReport report = open.self_test(context.log_is_good());
    if (context.monitor.self_tested) context.monitor.self_tested(report, limits);
    auto supervisor = begun_supervisor<typename O::Refusal>(limits, observer, report);
    close_loop(config, controller, open, supervisor, context, treatment);
  }
  open.finish(treatment);
}

/// Calls use(controller) after a warm-up: a dummy cycle, then a new controller in the same place,
/// so that the treatment's first cycle finds code and memory warm.
template <PredictiveController M, typename Use>
void with_warm(const Config& config, const ReducedModel& model, Use use) {
  std::optional<BasicController<M>> place;
  place.emplace(model, config.control, config.estimator);
  place->decide();
  place->step({.volume_temperature = 0.0, .applied_power = 0.0});
  use(place.emplace(model, config.control, config.estimator));
}

/// One treatment on an open device with the configuration's controller. Throws Error only before
/// the loop.
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
