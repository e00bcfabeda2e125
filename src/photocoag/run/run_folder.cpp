#include "photocoag/run/run_folder.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/percentile.hpp"
#include "photocoag/mpc/chance.hpp"
#include "photocoag/run/run_csv.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

// Median, 99 %, maximum and first of durations (ns), in us.
Json percentiles_us(const std::vector<std::int64_t>& ns) {
  if (ns.empty()) return Json::object();
  const double first = static_cast<double>(ns.front()) * 1e-3;
  const auto at = [&ns](double fraction) {
    return static_cast<double>(percentile(ns, fraction)) * 1e-3;
  };
  return {{"median", at(0.5)}, {"p99", at(0.99)}, {"max", at(1.0)}, {"first", first}};
}

// One row of the timing table each, and the bins themselves: [lower edge in us, count].
void add_histograms(const CycleHistograms& histograms, Json& summary) {
  const auto add = [&summary](const std::string& name, const DurationHistogram& histogram) {
    summary["timing"][name] = {{"median", histogram.quantile_us(0.5)},
                               {"p99", histogram.quantile_us(0.99)},
                               {"p99.9", histogram.quantile_us(0.999)},
                               {"max", histogram.max_us()},
                               {"min", histogram.min_us()},
                               {"cycles", histogram.cycles()},
                               {"without", histogram.skipped()}};
    Json bins = Json::array();
    for (std::size_t k = 0; k < histogram.bins().size(); ++k) {
      if (histogram.bins()[k] > 0) bins.push_back({k, histogram.bins()[k]});
    }
    summary["histograms"][name] = {{"bins", bins},
                                   {"below_0", histogram.negative()},
                                   {"overflow", histogram.overflow()},
                                   {"without", histogram.skipped()}};
  };
  add("wake_us", histograms.wake_late);
  add("compute_us", histograms.compute);
  add("write_us", histograms.write);
  add("slack_us", histograms.slack);
}

bool estimates_choroid(const Config& config) {
  return config.estimator.unknowns == Unknowns::kRpeAndChoroid;
}

Json optional_json(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

// The absorption factors of any other eye are unknown.
bool is_simulated(const Treatment& treatment) {
  return !treatment.device || treatment.device->name.starts_with("eye");
}

}  // namespace

RunSummaryNumbers summarize(const Config& config, const Treatment& treatment) {
  RunSummaryNumbers numbers;
  numbers.limit = config.control.peak_max;
  double squares = 0.0;
  std::size_t late = 0;
  numbers.truth_known = treatment.records.empty();
  double celsius = config.plant.tissue.ambient_celsius;  // of the peak, absolute
  for (const CycleRecord& record : treatment.records) {
    const double peak = record.truth.peak;
    numbers.truth_known = numbers.truth_known || std::isfinite(peak);
    numbers.peak_true_max = std::max(numbers.peak_true_max, peak);
    numbers.peak_estimate_max = std::max(numbers.peak_estimate_max, record.estimate.outputs.peak);
    numbers.limit_violations += peak > numbers.limit ? 1 : 0;
    numbers.limit_active_cycles += record.decision.limit_active ? 1 : 0;
    if (!numbers.time_to_95_percent && reached(peak, config.control.peak_reference)) {
      numbers.time_to_95_percent = record.time;
    }
    if (!std::isfinite(peak)) continue;  // unknown on a device
    const double next = config.plant.tissue.ambient_celsius + peak;
    for (std::size_t i = 0; i < kPublishedDamage.size(); ++i) {
      numbers.thermal_dose[i] +=
          damage_over(kPublishedDamage[i], celsius, next, config.control.period);
    }
    celsius = next;
    if (record.time > 0.05) {
      squares += (peak - config.control.peak_reference) * (peak - config.control.peak_reference);
      ++late;
    }
  }
  if (!numbers.truth_known) numbers.peak_true_max = std::numeric_limits<double>::quiet_NaN();
  if (late > 0) numbers.rms_error_after_50_ms = std::sqrt(squares / static_cast<double>(late));
  if (!treatment.records.empty() && is_simulated(treatment)) {
    numbers.absorption_error_final =
        treatment.records.back().estimate.absorption_factor / config.plant.absorption_factor - 1.0;
    if (estimates_choroid(config)) {
      numbers.choroid_error_final =
          treatment.records.back().estimate.choroid_factor / config.plant.choroid_factor - 1.0;
    }
  }
  numbers.dark_since = treatment.records.size();
  while (numbers.dark_since > 0 && !(treatment.records[numbers.dark_since - 1].power > 0.0)) {
    --numbers.dark_since;
  }
  const SafetyStatus& safety = treatment.outcome.safety;
  const bool by_supervisor = safety.reason != SafetyReason::kNone;
  if (treatment.outcome.stopped) {
    numbers.stopped_for =
        by_supervisor
            ? fmt::format("supervisor: {} ({})", to_string(safety.reason), to_string(safety.state))
            : "interrupted by the user";
  }
  if (treatment.recovered && !treatment.outcome.stopped) {
    numbers.stopped_for =
        "the program ended early or its disk was full: recovered from a log without the end";
  }
  return numbers;
}

ClaimedFolder open_run_folder(const fs::path& folder, const Config& config) {
  ClaimedFolder claimed(folder);
  write_file(claimed.path() / "config.toml", to_toml(config));
  return claimed;
}

ClaimedFolder open_new_run_folder(const Config& config) {
  ClaimedFolder claimed = ClaimedFolder::next_after(
      fs::path("runs") /
      fmt::format("{:%Y%m%d-%H%M%S}-seed{}", fmt::gmtime(std::time(nullptr)), config.run.seed));
  write_file(claimed.path() / "config.toml", to_toml(config));
  return claimed;
}

void write_run(const fs::path& folder, const Config& config, const Treatment& treatment) {
  write_file(folder / "run.csv", run_csv(treatment, estimates_choroid(config)));
  write_summary(folder, config, treatment);
}

void write_summary(const fs::path& folder, const Config& config, const Treatment& treatment) {
  write_file(folder / "summary.json", summary_json(config, treatment));
}

std::string summary_json(const Config& config, const Treatment& treatment) {
  const RunSummaryNumbers numbers = summarize(config, treatment);
  Json summary = {
      {"notice", kResearchNotice},
      {"peak_true_max_K", numbers.peak_true_max},
      {"peak_estimate_max_K", numbers.peak_estimate_max},
      {"limit_K", numbers.limit},
      {"limit_violations", numbers.truth_known ? Json(numbers.limit_violations) : Json()},
      {"limit_active_cycles", numbers.limit_active_cycles},
      {"time_to_95_percent_s", optional_json(numbers.time_to_95_percent)},
      {"rms_error_after_50_ms_K", optional_json(numbers.rms_error_after_50_ms)},
      {"absorption_error_final", optional_json(numbers.absorption_error_final)},
      {"cycles", treatment.outcome.cycles},
      {"overruns", treatment.outcome.overruns},
      {"full_order_states", treatment.full_order_states},
      {"stopped_for", numbers.stopped_for.empty() ? Json() : Json(numbers.stopped_for)},
      {"seed", config.run.seed},
      {"config_sha256", config_sha256(config)},
      {"version", version()},
      {"source_hash", source_hash()},
      // Not in a log.
      {"loop_wall_s", treatment.wall_seconds > 0.0 ? Json(treatment.wall_seconds) : Json()},
  };
  if (numbers.choroid_error_final) summary["choroid_error_final"] = *numbers.choroid_error_final;
  if (config.run.goal != Goal::kDuration) {
    summary["goal"] = {{"kind", config.run.goal == Goal::kHold ? "hold" : "dose"},
                       {"reached", treatment.outcome.goal_reached},
                       {"held_ms", treatment.goal.held() * 1e3},
                       {"dose", treatment.goal.dose()}};
  }
  if (config.control.robust == Robustness::kChance) {
    summary["chance"] = {{"limit_probability", config.control.limit_probability},
                         {"kept_deviations", kept_deviations(config.control.limit_probability)}};
  }
  if (treatment.prior_check) {
    const PriorCheck& check = *treatment.prior_check;
    summary["prior_check"] = {{"doubtful", check.doubtful()},
                              {"distance_probability", check.distance_probability},
                              {"innovations_probability", check.innovations_probability}};
  }
  for (std::size_t i = 0; i < kPublishedDamage.size(); ++i) {
    summary["thermal_dose"][std::string(kPublishedDamage[i].name)] =
        numbers.truth_known ? Json(numbers.thermal_dose[i]) : Json();
  }
  summary["safety"] = {{"supervised", config.safety.supervised},
                       {"state", to_string(treatment.outcome.safety.state)},
                       {"reason", to_string(treatment.outcome.safety.reason)},
                       {"detections", treatment.outcome.safety.detections},
                       {"energy_mJ", treatment.outcome.safety.energy * 1e3},
                       {"exposure_ms", treatment.outcome.safety.exposure * 1e3},
                       {"thermal_dose_upper", treatment.outcome.safety.dose}};
  if (treatment.device && treatment.device->lockstep) {
    summary["scheduling"] = treatment.scheduling;
    summary["page_faults"] = summary["timing"] = Json();  // not measured
  } else if (!treatment.scheduling.empty()) {
    summary["scheduling"] = treatment.scheduling;
    summary["page_faults"] = {{"minor", treatment.page_faults.minor},
                              {"major", treatment.page_faults.major}};
    summary["timing"] = {{"cycle_us", percentiles_us(treatment.timing.cycle)},
                         {"wake_late_us", percentiles_us(treatment.timing.wake_late)}};
  }
  if (treatment.histograms.wake_late.cycles() > 0) add_histograms(treatment.histograms, summary);
  if (treatment.log.segments > 0) {
    const LogTotals& totals = treatment.log.totals;
    const std::string& trouble = treatment.log.trouble;
    summary["log"] = {{"produced", totals.produced},
                      {"written", totals.written},
                      {"dropped", totals.dropped},
                      {"segments", treatment.log.segments},
                      {"alarm", trouble.empty() ? Json() : Json(trouble)}};
  }
  if (treatment.device) {
    const DeviceReport& device = *treatment.device;
    summary["device"] = {{"name", device.name},
                         {"pulses_per_period", device.pulses_per_period},
                         {"late_pulses", device.late_pulses},
                         {"late_commands", treatment.outcome.safety.late_commands},
                         {"pulse_peak_true_max_K", device.pulse_peak_max},
                         {"status", device.status}};
    if (!device.pacing.empty()) {
      summary["device"]["lockstep"] = device.lockstep;
      summary["device"]["pacing"] = device.pacing;
    }
  }
  // Names of files need not be UTF-8.
  const auto replace = Json::error_handler_t::replace;
  return summary.dump(2, ' ', false, replace) + "\n";
}

}  // namespace photocoag
