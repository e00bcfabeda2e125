#include "photocoag/session/attempt_outcome.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "photocoag/core/error.hpp"
#include "photocoag/core/outputs.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

struct Words {
  std::string_view word, words;
};
constexpr std::array<Words, kSpotEndings> kWords = {{
    {"planned", "not begun"},
    {"treated", "treated"},
    {"goal-missed", "goal missed"},
    {"over-limit", "limit exceeded"},
    {"stopped", "stopped by the supervisor"},
    {"device-fault", "device fault"},
    {"interrupted", "interrupted at 0 W"},
    {"may-have-emitted", "interrupted, may have emitted"},
    {"skipped", "skipped"},
}};

struct Mean {
  double count = 0.0, sum = 0.0, squares = 0.0;

  void add(double value) noexcept {
    if (!std::isfinite(value)) return;
    count += 1.0;
    sum += value;
    squares += value * value;
  }
  double mean() const noexcept { return count > 0.0 ? sum / count : kNotKnown; }
  double error() const noexcept {
    if (count < 2.0) return kNotKnown;
    const double variance = (squares - sum * sum / count) / (count - 1.0);
    return std::sqrt(std::max(0.0, variance) / count);
  }
};

SpotEnding ending_of(const Config& config, const Treatment& treatment,
                     const RunSummaryNumbers& numbers) {
  const SafetyReason reason = treatment.outcome.safety.reason;
  if (treatment.outcome.stopped && reason == SafetyReason::kNone) return SpotEnding::kInterrupted;
  if (treatment.outcome.stopped) {
    return treatment.device && is_device_fault(reason) ? SpotEnding::kDeviceFault
                                                       : SpotEnding::kStopped;
  }
  if (numbers.limit_violations > 0) return SpotEnding::kOverLimit;
  if (config.run.goal != Goal::kDuration && !treatment.outcome.goal_reached) {
    return SpotEnding::kGoalMissed;
  }
  return SpotEnding::kTreated;
}

}  // namespace

std::string_view word_of(SpotEnding ending) noexcept {
  return kWords[static_cast<std::size_t>(ending)].word;
}

std::string_view words_of(SpotEnding ending) noexcept {
  return kWords[static_cast<std::size_t>(ending)].words;
}

bool is_complete(SpotEnding ending) noexcept {
  return ending == SpotEnding::kTreated || ending == SpotEnding::kGoalMissed ||
         ending == SpotEnding::kOverLimit;
}

AttemptOutcome outcome_of(const Config& config, const Treatment& treatment) {
  const RunSummaryNumbers numbers = summarize(config, treatment);
  AttemptOutcome outcome;
  outcome.ending = ending_of(config, treatment, numbers);
  outcome.why = numbers.stopped_for;
  outcome.cycles = static_cast<double>(treatment.outcome.cycles);
  outcome.overruns = static_cast<double>(treatment.outcome.overruns);
  outcome.peak_true_max_K = numbers.peak_true_max;
  outcome.prior = config.estimator.absorption_initial;
  outcome.prior_sigma = config.estimator.absorption_sigma_initial;
  if (treatment.records.empty()) return outcome;
  outcome.peak_estimate_max_K = numbers.peak_estimate_max;
  const double period = config.control.period;
  const double end = treatment.records.back().time;
  Mean held, residual;
  double commanded = 0.0, emitted = 0.0;
  for (const CycleRecord& record : treatment.records) {
    const double peak = numbers.truth_known ? record.truth.peak : record.estimate.outputs.peak;
    outcome.energy_mJ += record.power * period * 1e3;
    outcome.exposure_ms += record.power > 0.0 ? period * 1e3 : 0.0;
    if (std::isnan(outcome.time_to_95_ms) && reached(peak, config.control.peak_reference)) {
      outcome.time_to_95_ms = record.time * 1e3;
    }
    if (treatment.device && std::isfinite(record.device_command) && !record.overrun) {
      commanded += record.device_command;
      emitted += record.power;
    }
    if (record.time <= 0.5 * end) continue;
    held.add(peak - config.control.peak_reference);
    residual.add(record.measured - record.estimate.outputs.volume);
  }
  outcome.held_error_K = held.mean();
  outcome.residual_K = residual.mean();
  outcome.residual_sigma_K = residual.error();
  outcome.absorption = treatment.records.back().estimate.absorption_factor;
  outcome.absorption_sigma = treatment.records.back().estimate.absorption_sigma;
  if (commanded > 0.0) outcome.power_ratio = emitted / commanded;
  if (config.run.goal != Goal::kDuration) outcome.thermal_dose = treatment.goal.dose();
  return outcome;
}

const std::vector<OutcomeNumber>& outcome_numbers() {
  static const std::vector<OutcomeNumber> numbers = {
      {"energy_mJ", "mJ", "emitted; of a spot that may have emitted the most that it could have",
       &AttemptOutcome::energy_mJ},
      {"exposure_ms", "ms", "time with light", &AttemptOutcome::exposure_ms},
      {"cycles", "1", "control periods", &AttemptOutcome::cycles},
      {"overruns", "1", "periods that the controller missed", &AttemptOutcome::overruns},
      {"peak_true_max_K", "K", "highest true peak; NaN: not known",
       &AttemptOutcome::peak_true_max_K},
      {"peak_estimate_max_K", "K", "highest estimated peak", &AttemptOutcome::peak_estimate_max_K},
      {"time_to_95_ms", "ms",
       "first cycle at 95 % of the reference, of the true peak if it is known",
       &AttemptOutcome::time_to_95_ms},
      {"held_error_K", "K", "mean of that peak minus the reference over the second half",
       &AttemptOutcome::held_error_K},
      {"absorption", "1", "final estimate of the absorption factor", &AttemptOutcome::absorption},
      {"absorption_sigma", "1", "its standard deviation", &AttemptOutcome::absorption_sigma},
      {"prior", "1", "absorption factor before the first sample", &AttemptOutcome::prior},
      {"prior_sigma", "1", "its standard deviation", &AttemptOutcome::prior_sigma},
      {"residual_K", "K", "mean of measured minus estimated volume temperature, second half",
       &AttemptOutcome::residual_K},
      {"residual_sigma_K", "K", "its standard error", &AttemptOutcome::residual_sigma_K},
      {"power_ratio", "1", "emitted over commanded power, where the device tells both",
       &AttemptOutcome::power_ratio},
      {"thermal_dose", "1", "Arrhenius integral at the estimated peak, of spots with a goal",
       &AttemptOutcome::thermal_dose}};
  return numbers;
}

Json to_json(const AttemptOutcome& outcome) {
  Json json = {{"spot", outcome.spot},
               {"attempt", outcome.attempt},
               {"folder", outcome.folder},
               {"ending", word_of(outcome.ending)},
               {"why", outcome.why.empty() ? Json() : Json(outcome.why)}};
  for (const OutcomeNumber& number : outcome_numbers()) {
    const double value = outcome.*number.value;
    json[std::string(number.name)] = std::isfinite(value) ? Json(value) : Json();
  }
  return json;
}

AttemptOutcome outcome_from_json(const Json& json, const std::string& where) {
  try {
    AttemptOutcome outcome;
    outcome.spot = json.at("spot").get<std::string>();
    outcome.attempt = json.at("attempt").get<int>();
    outcome.folder = json.at("folder").get<std::string>();
    const auto word = json.at("ending").get<std::string>();
    const auto found = std::find_if(kWords.begin(), kWords.end(),
                                    [&](const Words& one) { return one.word == word; });
    if (found == kWords.end()) throw Error("unknown ending " + word);
    outcome.ending = static_cast<SpotEnding>(found - kWords.begin());
    if (!json.at("why").is_null()) outcome.why = json.at("why").get<std::string>();
    for (const OutcomeNumber& number : outcome_numbers()) {
      const Json& value = json.at(std::string(number.name));
      outcome.*number.value = value.is_null() ? kNotKnown : value.get<double>();
    }
    return outcome;
  } catch (const std::exception& error) {
    throw Error(
        ErrorParts{.where = where, .problem = "no outcome of a spot", .found = error.what()});
  }
}

}  // namespace photocoag
