// Role: setup; the supervisor's limits and its observer from the configuration. Used by run, fmu,
// fault_table, console, apps. Units: SI.
#pragma once

#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/core/discretization.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

/// From [safety], [control], [estimator] and [tissue]; the calibrated noise is plant.noise_K.
SafetyLimits safety_limits(const Config& config);

/// The observer's model: the cross-check's responses of [tissue] (run/tissue_reference.hpp), with
/// few lags, in the eye's time scheme (plant.discretization), independent of the controller's
/// model. `pulses` above 0: samples are means over that many pulses per period (P9). Allocates;
/// some 0.1 s the first time for a tissue.
ObserverModel observer_model(const Config& config, int pulses = 0);
/// The same from the settings it depends on. `period`: s, `power_max`: W.
ObserverModel observer_model(const Tissue& tissue, const EstimatorSettings& estimator,
                             double period, Discretization eye, double power_max = 0.1,
                             int pulses = 0);

/// Report with the statistics of `baseline`, K, samples of the cold eye at 0 W; the rest is left at
/// its defaults.
SelfTestReport self_test_of(const std::vector<double>& baseline);

/// Solves a small quadratic program with a known answer; true if correct to 1e-9.
bool solver_is_exact();

/// The report of a healthy device with sample noise `noise`, K: where a self-test was passed before
/// or is not of interest.
SelfTestReport passed_self_test(double noise);

/// The items of a self-test that Supervisor::finish_self_test would reject, each with advice.
std::vector<std::string> failed_items(const SelfTestReport& report, const SafetyLimits& limits);

/// Error for the user after a failed self-test.
ErrorParts not_ready(const SelfTestReport& report, const SafetyLimits& limits);

/// A supervisor in TREATING; throws `Refusal` if the self-test failed.
template <typename Refusal = Error>
Supervisor begun_supervisor(const SafetyLimits& limits, const ObserverModel& observer,
                            const SelfTestReport& report) {
  Supervisor supervisor(limits, observer);
  supervisor.power_on();
  if (!supervisor.finish_self_test(report) || !supervisor.ready() ||
      !supervisor.begin(report.foot_switch)) {
    throw Refusal(not_ready(report, limits));
  }
  return supervisor;
}

}  // namespace photocoag
