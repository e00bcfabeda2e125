// Role: tests of safety and loop; supervisors ready to treat.
#pragma once

#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag::testing {

inline SelfTestReport good_self_test() {
  return {.samples = 64,
          .mean = 0.01,
          .sigma = 0.288,
          .power_at_zero = 0.0,
          .interlock_closed = true,
          .shutter_open = true,
          .foot_switch = true,
          .watchdog_tripped = true,
          .model_matches = true,
          .solver_exact = true,
          .log_has_room = true};
}

/// The observer of a model's tissue and time scheme.
inline ObserverModel observer_for(const ReducedModel& model,
                                  const EstimatorSettings& estimator = {}) {
  return observer_model(model.tissue, estimator, model.period, model.discretization);
}

inline Supervisor treating_supervisor(const ReducedModel& model, SafetyLimits limits = {}) {
  limits.period = model.period;
  EstimatorSettings estimator;
  estimator.absorption_min = limits.absorption_min;
  estimator.absorption_max = limits.absorption_max;
  Supervisor supervisor(limits, observer_for(model, estimator));
  supervisor.power_on();
  supervisor.finish_self_test(good_self_test());
  supervisor.ready();
  supervisor.begin(true);
  return supervisor;
}

}  // namespace photocoag::testing
