// Role: setup; the supervisor's limits and its witness from configuration and model. Used by run,
// trials, tests. Units: SI.
#pragma once

#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/rom/reduced_model.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

/// What [safety], [control], [estimator] and [tissue] say. The calibrated noise is that of the
/// simulated eye (plant.noise_K).
SafetyLimits safety_limits(const Config& config);

/// The model's discrete-time modes, at absorptions spread evenly in logarithm between the
/// estimator's bounds: alpha at the beta that the estimator is told, or both if it estimates both.
/// The eigenvalues of A_d must be real (they are for heat) and at most
/// kWitnessModes. Throws Error otherwise. Allocates.
WitnessModel witness_model(const ReducedModel& model, const EstimatorSettings& estimator = {});

/// Runs the self-test on `baseline` (samples of the cold eye at 0 W) and what else was found.
SelfTestReport self_test_of(const std::vector<double>& baseline);

/// Solves a small quadratic program with a known answer; true if it comes out to 1e-9.
bool solver_is_exact();

/// The report of a healthy device whose samples scatter by `noise`, K: where a self-test has been
/// passed before, or is not what is looked at.
SelfTestReport passed_self_test(double noise);

/// The items of a self-test that Supervisor::finish_self_test would refuse, each with what to do.
std::vector<std::string> failed_items(const SelfTestReport& report, double noise);

/// What to tell the user after a failed self-test of a device calibrated to `noise`, K.
ErrorParts not_ready(const SelfTestReport& report, double noise);

}  // namespace photocoag
