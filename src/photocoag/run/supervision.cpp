#include "photocoag/run/supervision.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numeric>

#include "photocoag/core/error.hpp"
#include "photocoag/qp/dense.hpp"
#include "photocoag/run/pulse_model.hpp"
#include "photocoag/run/tissue_reference.hpp"
#include "photocoag/safety/power_check.hpp"
#include "photocoag/tissue/thermal_dose.hpp"

namespace photocoag {
namespace {

// Relative error of the observer's peak: of the cross-check, and of linear interpolation between
// absorptions.
constexpr double kObserverError = 2e-3;

ObserverModel fitted_observer(const TissueReference& reference, bool both, double period,
                              Discretization eye, double power_max, int pulses,
                              const IntersampleTiming& timing) {
  const crosscheck::FewLags lags =
      crosscheck::few_lags(reference.lags, kObserverModes, eye, period);
  ObserverModel observer;
  std::copy(lags.decay.begin(), lags.decay.end(), observer.decay.begin());
  observer.peak_error = kObserverError;
  observer.peak_error_K = power_max * lags.peak_error;
  if (both) {
    observer.absorptions = kObserverAbsorptions / 2;
    observer.choroids = kObserverChoroids;
    // At a constant temperature 20 samples cannot separate two unknowns: the rise, which does, must
    // be remembered longer.
    observer.memory = 0.99;
  }
  for (std::size_t j = 0; j < reference.observed; ++j) {
    observer.absorption[j % observer.absorptions] = reference.at[j].alpha;
    observer.choroid[j / observer.absorptions] = reference.at[j].beta;
    const crosscheck::LagWeights& weights = lags.at[j];
    std::copy(weights.volume.begin(), weights.volume.end(), observer.volume[j].begin());
    std::copy(weights.peak.begin(), weights.peak.end(), observer.peak[j].begin());
    const std::vector<double>& gains = reference.lags.at[j].peak;
    observer.steady_peak[j] = std::accumulate(gains.begin(), gains.end(), 0.0);
  }
  if (pulses > 0) average_over_pulses(observer, pulses, reference.lags, period);
  if (!timing.plain()) average_between_samples(observer, timing, reference.lags, period);
  return observer;
}

}  // namespace

SafetyLimits safety_limits(const Config& config) {
  const ArrheniusParameters& damage = kPublishedDamage[0];
  const bool enforce = config.safety.real_time == RealTimeMode::kEnforce;
  return {.period = config.control.period,
          .power_max = config.control.power_max,
          .power_rise_max = config.safety.power_rise_max,
          .peak_max = config.control.peak_max,
          .peak_reference = config.control.peak_reference,
          .noise = config.plant.noise,
          .absorption_min = config.estimator.absorption_min,
          .absorption_max = config.estimator.absorption_max,
          .ambient_celsius = config.tissue.ambient_celsius,
          .energy_max = config.safety.energy_max,
          .exposure_max = config.safety.exposure_max,
          .dose_max = config.safety.thermal_dose_max,
          .dose_log_frequency = damage.log_frequency,
          .dose_activation_energy = damage.activation_energy,
          .power_accuracy = config.safety.power_accuracy,
          .gain_accuracy = config.safety.sample_gain_accuracy,
          .overruns_in_a_row_max = enforce ? 1 : 100,
          .overruns_per_hundred = enforce ? 1 : 100,
          .command_delay = config.control.delay,
          .command_held = enforce ? 1 : 0,
          .check_quiet = config.plant.noise > 0.0 ? 1 : 0};
}

ObserverModel observer_model(const Config& config, int pulses) {
  return observer_model(config.tissue, config.estimator, config.control.period,
                        config.plant.discretization, config.control.power_max, pulses);
}

ObserverModel observer_model(const Tissue& tissue, const EstimatorSettings& estimator,
                             double period, Discretization eye, double power_max, int pulses) {
  // Thousands of treatments of the same tissue ask for the same observer.
  struct Kept {
    std::shared_ptr<const TissueReference> reference;
    double period = 0.0;
    Discretization eye{};
    double power_max = 0.0;
    int pulses = 0;
    IntersampleTiming timing;
    std::shared_ptr<const ObserverModel> observer;
  };
  static std::mutex mutex;
  static Kept kept;
  const auto reference = tissue_reference(tissue, estimator, period);
  const std::lock_guard lock(mutex);
  if (kept.reference != reference || kept.period != period || kept.eye != eye ||
      kept.power_max != power_max || kept.pulses != pulses || kept.timing != estimator.timing) {
    const bool both = reference->at.front().beta != reference->at[reference->observed - 1].beta;
    kept = {reference,
            period,
            eye,
            power_max,
            pulses,
            estimator.timing,
            std::make_shared<const ObserverModel>(fitted_observer(
                *reference, both, period, eye, power_max, pulses, estimator.timing))};
  }
  return *kept.observer;
}

SelfTestReport self_test_of(const std::vector<double>& baseline) {
  const auto count = static_cast<double>(std::max<std::size_t>(baseline.size(), 1));
  SelfTestReport report{.samples = static_cast<int>(baseline.size())};
  report.mean = std::accumulate(baseline.begin(), baseline.end(), 0.0) / count;
  for (const double value : baseline) {
    report.sigma += (value - report.mean) * (value - report.mean) / count;
  }
  report.sigma = std::sqrt(report.sigma);
  return report;
}

bool solver_is_exact() {
  // min (u0 - 2)^2 + (u1 - 1)^2 with u <= 1.5 and u0 + u1 <= 2: u = (1.5, 0.5).
  QpProblem problem;
  problem.resize(2, 1);
  problem.hessian << 2.0, 0.0, 0.0, 2.0;
  problem.gradient << -4.0, -2.0;
  problem.lower.setZero();
  problem.upper.setConstant(1.5);
  problem.rows << 1.0, 1.0;
  problem.limit << 2.0;
  QpSolution solution;
  DenseSolver solver;
  return solver.solve(problem, solution) == QpStatus::kSolved &&
         std::abs(solution.power[0] - 1.5) < 1e-9 && std::abs(solution.power[1] - 0.5) < 1e-9;
}

SelfTestReport passed_self_test(double noise) {
  return {.samples = 64,
          .sigma = noise,
          .interlock_closed = true,
          .shutter_open = true,
          .foot_switch = true,
          .watchdog_tripped = true,
          .model_matches = true,
          .solver_exact = true,
          .log_has_room = true};
}

std::vector<std::string> failed_items(const SelfTestReport& report, const SafetyLimits& limits) {
  const SelfTestBounds bounds = self_test_bounds(limits, report.samples);
  std::vector<std::string> failed;
  const auto check = [&](bool good, std::string text) {
    if (!good) failed.push_back(std::move(text));
  };
  check(report.samples >= SelfTestBounds::kSamples,
        fmt::format("samples: {} at 0 W came in time, at least {} are needed; free the machine of "
                    "other work, or for a simulated eye photoacoustics.eye_pacing=lockstep",
                    report.samples, SelfTestBounds::kSamples));
  check(std::abs(report.mean) <= bounds.mean,
        fmt::format("mean: {:.3f} K at 0 W, at most {:.3f}; let the tissue cool (a simulated eye: "
                    "--tell cold), or calibrate again",
                    report.mean, bounds.mean));
  check(report.sigma <= bounds.sigma_high,
        fmt::format("noise: {:.3f} K, at most twice plant.noise_K = {:g}; find the disturbance, or "
                    "set that key",
                    report.sigma, limits.noise));
  check(report.sigma >= bounds.sigma_low,
        fmt::format("noise: {:.3f} K, at least half of plant.noise_K = {:g}; is it a live signal? "
                    "Else set that key",
                    report.sigma, limits.noise));
  check(
      std::abs(report.power_at_zero) <= kReadbackFloor,
      fmt::format(
          "power: {:g} W read back with 0 W commanded; close the shutter, check laser and monitor",
          report.power_at_zero));
  std::string open;
  if (!report.interlock_closed) open += ", its interlock open";
  if (!report.shutter_open) open += ", its shutter closed";
  if (!report.foot_switch) open += ", its foot switch released";
  check(report.switches_ready(), fmt::format("switches: the device reports{}, no light was asked "
                                             "for; make them ready before the start",
                                             open.substr(std::min<std::size_t>(1, open.size()))));
  check(report.watchdog_tripped || !report.switches_ready(),
        "watchdog: a small power without a further command did not appear and end as it must; "
        "check the device's watchdog, or free the machine of other work");
  check(report.model_matches, "model: it is not for this tissue and period; reduce it again");
  check(report.solver_exact, "solver: a known problem is not solved to 1e-9; build again");
  check(report.log_has_room, "log: it cannot be written; make room on its disk");
  return failed;
}

ErrorParts not_ready(const SelfTestReport& report, const SafetyLimits& limits) {
  return {.where = "self-test",
          .problem = "the device is not ready",
          .found = fmt::format("{}", fmt::join(failed_items(report, limits), "; ")),
          .accepted = "docs/safety.md, self-test"};
}

}  // namespace photocoag
