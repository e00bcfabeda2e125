// Role: setup; the supervisor's limits and its observer from the configuration. Used by run,
// fault_table, tests. Units: SI.
#pragma once

#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/core/discretization.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

/// What [safety], [control], [estimator] and [tissue] say. The calibrated noise is that of the
/// simulated eye (plant.noise_K).
SafetyLimits safety_limits(const Config& config);

/// The observer's numbers: the cross-check's responses of [tissue] (run/tissue_reference.hpp), with
/// few lags, in the time scheme of the eye (plant.discretization). Nothing of it comes from the
/// controller's model. `pulses` above 0: samples are means over so many pulses per period (P9).
/// Allocates; some 0.1 s the first time for a tissue.
ObserverModel observer_model(const Config& config, int pulses = 0);
/// The same from what it depends on.
ObserverModel observer_model(const Tissue& tissue, const EstimatorSettings& estimator,
                             double period, Discretization eye, double power_max = 0.1,
                             int pulses = 0);

/// Runs the self-test on `baseline` (samples of the cold eye at 0 W) and what else was found.
SelfTestReport self_test_of(const std::vector<double>& baseline);

/// Solves a small quadratic program with a known answer; true if it comes out to 1e-9.
bool solver_is_exact();

/// The report of a healthy device whose samples scatter by `noise`, K: where a self-test has been
/// passed before, or is not what is looked at.
SelfTestReport passed_self_test(double noise);

/// The items of a self-test that Supervisor::finish_self_test would refuse, each with what to do.
std::vector<std::string> failed_items(const SelfTestReport& report, const SafetyLimits& limits);

/// What to tell the user after a failed self-test.
ErrorParts not_ready(const SelfTestReport& report, const SafetyLimits& limits);

/// A supervisor that lets the treatment begin; throws `Refusal` if the self-test was not passed.
template <typename Refusal = Error>
Supervisor begun_supervisor(const SafetyLimits& limits, const ObserverModel& observer,
                            const SelfTestReport& report) {
  Supervisor supervisor(limits, observer);
  supervisor.power_on();
  if (!supervisor.finish_self_test(report) || !supervisor.ready() || !supervisor.begin(true)) {
    throw Refusal(not_ready(report, limits));
  }
  return supervisor;
}

}  // namespace photocoag
