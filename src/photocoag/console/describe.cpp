#include "photocoag/console/describe.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/rom/file.hpp"
#include "photocoag/run/calibration_file.hpp"
#include "photocoag/run/reasons.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

Json real(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json line(std::string_view name, std::string value) {
  return {{"name", name}, {"value", std::move(value)}};
}

std::string range(double low, double high) { return fmt::format("{:g} to {:g}", low, high); }

Json model_lines(const ReducedModel& model) {
  Json lines = Json::array();
  lines.push_back(
      line("Model", fmt::format("{}{}, order {}", model.method,
                                model.refinement == "none" ? "" : ", refined", model.order())));
  lines.push_back(line("SHA-256", sha256_hex(to_json(model))));
  lines.push_back(line("Period", fmt::format("{:g} ms", model.period * 1e3)));
  lines.push_back(
      line("Absorption factor", range(model.parameters[0].min, model.parameters[0].max)));
  lines.push_back(
      line("Largest measured error",
           fmt::format("{:.2f} % of the peak, {:.2f} % of the volume temperature",
                       100.0 * model.error.peak_max(), 100.0 * model.error.volume_max())));
  if (model.certificate) {
    const ErrorCertificate& certificate = *model.certificate;
    lines.push_back(
        line("Certificate",
             fmt::format("any power, first {:g} ms: {:.2f} % of the peak; any time: {:.2f} %",
                         certificate.treatment_duration * 1e3,
                         100.0 * certificate.peak.treatment_relative_max(),
                         100.0 * certificate.peak.relative_max())));
  } else {
    lines.push_back(line("Certificate", "none: the error is measured, not proved"));
  }
  return lines;
}

Json limit_lines(const Config& config) {
  const SafetySettings& safety = config.safety;
  Json lines = Json::array();
  lines.push_back(line("Peak", fmt::format("{:.2f} K", config.control.peak_max)));
  lines.push_back(line("Power", fmt::format("{:g} mW", config.control.power_max * 1e3)));
  lines.push_back(
      line("Power rise per period", fmt::format("{:g} mW", safety.power_rise_max * 1e3)));
  lines.push_back(line("Energy", fmt::format("{:g} J", safety.energy_max)));
  lines.push_back(line("Exposure", fmt::format("{:g} s", safety.exposure_max)));
  lines.push_back(line("Thermal dose", safety.thermal_dose_max > 0.0
                                           ? fmt::format("{:g}", safety.thermal_dose_max)
                                           : std::string("not limited")));
  lines.push_back(line("Supervisor", safety.supervised ? "on" : "OFF"));
  lines.push_back(line("Real time", safety.real_time == RealTimeMode::kEnforce
                                        ? "enforced"
                                        : "observed, not enforced: simulated eyes only"));
  return lines;
}

std::string goal_of(const Config& config) {
  const std::string most = fmt::format("{:g} ms", config.run.duration * 1e3);
  switch (config.run.goal) {
    case Goal::kHold:
      return fmt::format("{:g} ms at 95 % of the reference, at most {}", config.run.hold * 1e3,
                         most);
    case Goal::kDose:
      return fmt::format("thermal dose {:g}, at most {}", config.run.dose, most);
    case Goal::kDuration:
      break;
  }
  return most;
}

Json aim_lines(const Config& config) {
  Json lines = Json::array();
  lines.push_back(
      line("Peak reference", fmt::format("{:.2f} K above ambient", config.control.peak_reference)));
  lines.push_back(line("Until", goal_of(config)));
  lines.push_back(line("Horizon", fmt::format("{} periods of {:g} ms", config.control.horizon,
                                              config.control.period * 1e3)));
  if (config.control.robust == Robustness::kChance) {
    lines.push_back(line("Allowed to exceed the limit",
                         fmt::format("{:g} of all treatments", config.control.limit_probability)));
  }
  return lines;
}

std::string spread_of(const RandomQuantity& quantity) {
  const std::string within = " within " + range(quantity.low, quantity.high);
  switch (quantity.distribution) {
    case Distribution::kNormal:
      return fmt::format("{:g} ± {:g}{}", quantity.center, quantity.spread, within);
    case Distribution::kLogNormal:
      return fmt::format("median {:g}, factor e^±{:g}{}", quantity.center, quantity.spread, within);
    case Distribution::kUniform:
      break;
  }
  return "uniform" + within;
}

Json prior_lines(const Config& config) {
  Json lines = Json::array();
  lines.push_back(
      line("Absorption factor",
           fmt::format("{:g} ± {:g} within {}", config.estimator.absorption_initial,
                       config.estimator.absorption_sigma_initial,
                       range(config.estimator.absorption_min, config.estimator.absorption_max))));
  for (const RandomQuantity& quantity : config.prior.quantities) {
    lines.push_back(
        line(quantity.key, spread_of(quantity) + (config.uses_prior() ? "" : " (not used)")));
  }
  return lines;
}

std::string age_of(const std::string& file) {
  std::error_code error;
  const auto written = fs::last_write_time(file, error);
  if (error) return "unknown";
  const std::chrono::duration<double> age = fs::file_time_type::clock::now() - written;
  const double days = age.count() / 86400.0;
  return days < 2.0 ? fmt::format("{:.1f} hours", 24.0 * days) : fmt::format("{:.0f} days", days);
}

Json calibration_lines(const Config& config) {
  Json lines = Json::array();
  lines.push_back(line("Noise of a sample", fmt::format("{:g} K", config.plant.noise)));
  if (config.photoacoustics.sampling == Sampling::kInstant) {
    lines.push_back(line("Curve", "none: the samples are temperatures"));
    return lines;
  }
  const std::string& file = config.photoacoustics.calibration;
  lines.push_back(line("Curve", load_curve(file).source));
  lines.push_back(line("Age", file.empty() ? "never calibrated" : age_of(file)));
  return lines;
}

Json findings(const std::vector<Finding>& list) {
  Json json = Json::array();
  for (const Finding& finding : list) {
    json.push_back({{"topic", finding.topic},
                    {"health", to_string(finding.health)},
                    {"found", finding.found},
                    {"advice", finding.advice}});
  }
  return json;
}

// Names of files and texts of devices need not be UTF-8.
std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string before_message(const Config& config, const ReducedModel& model,
                           const ConsoleDevice& device, const std::vector<Finding>& real_time) {
  return dumped({{"type", "before"},
                 {"device", device.name},
                 {"browser_starts", device.browser_starts},
                 {"self_test_first", device.self_test_first},
                 {"period_ms", config.control.period * 1e3},
                 {"peak_reference_K", config.control.peak_reference},
                 {"peak_max_K", config.control.peak_max},
                 {"power_max_W", config.control.power_max},
                 {"planned_ms", config.run.duration * 1e3},
                 {"aim", aim_lines(config)},
                 {"limits", limit_lines(config)},
                 {"model", model_lines(model)},
                 {"prior", prior_lines(config)},
                 {"calibration", calibration_lines(config)},
                 {"real_time", findings(real_time)}});
}

std::string spot_message(const Config& config, const Treatment& treatment, int number,
                         const fs::path& folder, const std::string& failure) {
  const RunSummaryNumbers numbers = summarize(config, treatment);
  const SafetyStatus& safety = treatment.outcome.safety;
  const auto optional = [](const std::optional<double>& value, double scale) {
    return value ? real(*value * scale) : Json();
  };
  const bool by_hand = treatment.outcome.stopped && safety.reason == SafetyReason::kNone;
  ReasonWords words = words_of(safety.reason);
  if (by_hand) words = {"Stopped by hand.", ""};
  if (treatment.outcome.goal_reached) words = {"The goal was reached.", ""};
  return dumped(
      {{"type", "spot"},
       {"spot", number},
       {"failure", failure},
       {"state", to_string(safety.state)},
       {"reason", to_string(safety.reason)},
       {"why", failure.empty() ? std::string(words.what) : "The spot did not start."},
       {"what_to_do", words.then},
       {"stopped", treatment.outcome.stopped},
       {"folder", fs::absolute(folder).string()},
       {"cycles", treatment.outcome.cycles},
       {"seed", config.run.seed},
       {"peak_true_max_K", real(numbers.truth_known ? numbers.peak_true_max : NAN)},
       {"peak_estimate_max_K", real(numbers.peak_estimate_max)},
       {"limit_K", real(numbers.limit)},
       {"limit_violations", numbers.truth_known ? Json(numbers.limit_violations) : Json()},
       {"time_to_95_percent_ms", optional(numbers.time_to_95_percent, 1e3)},
       {"rms_error_after_50_ms_K", optional(numbers.rms_error_after_50_ms, 1.0)},
       {"absorption_estimate", treatment.records.empty()
                                   ? Json()
                                   : real(treatment.records.back().estimate.absorption_factor)},
       {"absorption_sigma", treatment.records.empty()
                                ? Json()
                                : real(treatment.records.back().estimate.absorption_sigma)},
       {"energy_mJ", safety.energy * 1e3},
       {"exposure_ms", safety.exposure * 1e3},
       {"thermal_dose_upper", safety.dose},
       {"overruns", treatment.outcome.overruns},
       {"detections", safety.detections},
       {"scheduling", treatment.scheduling},
       {"log_alarm", treatment.log.trouble}});
}

}  // namespace photocoag
