#include "photocoag/config/usage.hpp"

#include <algorithm>
#include <initializer_list>
#include <string>
#include <utility>

#include "photocoag/config/fields.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr std::uint32_t bits(std::initializer_list<Use> list) {
  std::uint32_t all = 0;
  for (const Use use : list) all |= static_cast<std::uint32_t>(use);
  return all;
}

constexpr std::uint32_t kAll = 0xFFFFFFFFU;
constexpr std::uint32_t kTreating =
    bits({Use::kSimulate, Use::kTreat, Use::kTreatEye, Use::kTreatDriver});
constexpr std::uint32_t kMany = bits({Use::kEstimation, Use::kSpots});
/// The controller alone.
constexpr std::uint32_t kCode = bits({Use::kExportC, Use::kFmuController});
constexpr std::uint32_t kFmuEye = bits({Use::kFmuEye});
constexpr std::uint32_t kReducing = bits({Use::kReduce, Use::kResponseReduced});
constexpr std::uint32_t kShowing = bits({Use::kResponseFull, Use::kResponseReduced});
constexpr std::uint32_t kPulsed = bits({Use::kTreatEye, Use::kEye});
constexpr std::uint32_t kOfTheEye = bits({Use::kBoundaries, Use::kSchemeComparison}) | kShowing;
constexpr std::uint32_t kSteps =
    bits({Use::kEye, Use::kCompareReductions, Use::kExport}) | kReducing | kShowing;
/// Keys of the simulated eye in this process.
constexpr std::uint32_t kBench = bits({Use::kSimulate, Use::kTreat, Use::kSpots, Use::kFmuEye});
/// Keys of a bench's timing that a controller may account for.
constexpr std::uint32_t kTold = (kBench & ~kFmuEye) | kCode | bits({Use::kTreatDriver});
constexpr std::uint32_t kBuilding = kAll & ~bits({Use::kCalibrate});

/// The longest rule that is a prefix of the key applies.
struct Rule {
  std::string_view beginning;
  std::uint32_t used_by;
};
constexpr Rule kRules[] = {
    {"control.", kTreating | kMany | kCode},
    {"control.period_ms", kTreating | kMany | kSteps | kCode | kFmuEye},
    {"control.delay_cycles", kTreating | kMany | kCode | kFmuEye},
    {"control.robust", kTreating | kMany | kReducing | kCode},
    {"control.robust_sigma", kTreating | kMany | kCode},
    {"estimator.", kTreating | kMany | kCode},
    {"estimator.kind", kTreating | kMany | kReducing | kCode},
    {"estimator.sample_averaging_periods", kTold},
    {"estimator.sample_lag_periods", kTold},
    {"estimator.power_lag_periods", kTold},
    {"safety.", kTreating | kMany | bits({Use::kFmuController})},
    {"safety.real_time", bits({Use::kTreat, Use::kTreatEye, Use::kTreatDriver})},
    {"safety.core", bits({Use::kTreat, Use::kTreatEye, Use::kTreatDriver, Use::kEye})},
    {"model.", kTreating | kMany | kReducing | kCode | kFmuEye},
    {"model.file", kTreating | kMany | kCode | kFmuEye | bits({Use::kResponseReduced})},
    {"model.discretization", kTreating | kMany | kReducing | kCode | kFmuEye |
                                 bits({Use::kCompareReductions, Use::kExport})},
    {"grid.", kBuilding},
    {"tissue.", kBuilding},
    {"tissue.ambient_C", kAll},
    {"uncertainty.",
     bits({Use::kSimulate, Use::kTreat, Use::kTreatEye, Use::kTreatDriver, Use::kSpots}) | kCode},
    {"prior", kTreating | kReducing | kCode},
    {"plant.", bits({Use::kSimulate, Use::kTreat, Use::kTreatEye, Use::kEye}) | kMany | kFmuEye},
    {"plant.model", bits({Use::kSimulate, Use::kTreat}) | kFmuEye},
    {"plant.absorption_factor", bits({Use::kSimulate, Use::kTreat, Use::kTreatEye, Use::kEye}) |
                                    bits({Use::kEstimation}) | kOfTheEye | kFmuEye},
    {"plant.choroid_factor",
     bits({Use::kSimulate, Use::kTreat, Use::kTreatEye, Use::kEye, Use::kExport}) | kMany |
         kOfTheEye | kFmuEye},
    {"plant.noise_K", kTreating | kMany | bits({Use::kEye}) | kCode | kFmuEye},
    {"plant.sample_averaging_periods", kBench},
    {"plant.sample_lag_periods", kBench},
    {"plant.power_lag_periods", kBench},
    {"plant.power_readback", kBench},
    {"plant.power_gain", kBench},
    {"plant.sample_gain", kBench},
    {"plant.sample_offset_K", kBench},
    {"plant.absorption_drift_per_s", kBench},
    {"plant.discretization", bits({Use::kSimulate, Use::kTreat}) | kMany | kShowing | kFmuEye},
    {"plant.tissue",
     bits({Use::kSimulate, Use::kTreat, Use::kTreatEye, Use::kEye, Use::kSchemeComparison}) |
         kMany | kShowing | kFmuEye},
    {"photoacoustics.", bits({Use::kTreatEye})},
    {"photoacoustics.sampling", bits({Use::kTreatEye}) | kCode | kFmuEye},
    {"photoacoustics.calibration", kPulsed | bits({Use::kCalibrate})},
    {"photoacoustics.eye_calibration", kPulsed | bits({Use::kCalibrate})},
    {"photoacoustics.eye_noise", kPulsed},
    {"photoacoustics.pulse_period_ms", kPulsed},
    {"run.", kTreating | kMany},
    {"run.duration_ms", kTreating | kMany | kFmuEye | bits({Use::kFmuController})},
    {"run.seed",
     bits({Use::kSimulate, Use::kTreat, Use::kTreatEye, Use::kEye, Use::kCalibrate}) | kFmuEye},
};

/// A key that another one switches off.
std::string switched_off(const Config& c, const std::string& key, Use use) {
  const auto is = [&key](std::initializer_list<std::string_view> keys) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
  };
  const bool many = (kMany & static_cast<std::uint32_t>(use)) != 0;
  if (use == Use::kFmuEye && key.starts_with("model.") && c.plant.model == PlantModel::kFull) {
    return "plant.model = \"full\"";
  }
  if (key == "control.osqp_tolerance" && c.control.solver == SolverKind::kDense) {
    return "control.solver = \"dense\"";
  }
  const bool chance = c.control.robust == Robustness::kChance;
  if (key == "control.robust_sigma" && c.control.robust != Robustness::kCertified &&
      !c.uncertainty.declared() && !many) {
    return chance ? "control.robust = \"chance\"" : "control.robust = \"none\"";
  }
  if (!c.uses_prior() && key == "prior") {
    return "neither estimator.kind = \"posterior\" nor control.robust = \"chance\"";
  }
  if (!chance && is({"control.limit_probability", "control.identification_power_W",
                     "control.identification_sigma_K"})) {
    return "control.robust is not \"chance\"";
  }
  if (c.uses_prior() && c.prior.find("plant.absorption_factor") != nullptr &&
      is({"estimator.absorption_initial", "estimator.absorption_sigma_initial"})) {
    return "the [[prior]] of plant.absorption_factor";
  }
  if (c.uses_prior() && c.prior.find("plant.noise_K") != nullptr &&
      key == "estimator.measurement_noise_K") {
    return "the [[prior]] of plant.noise_K";
  }
  if (c.control.identification_duration == 0.0 &&
      is({"control.identification_power_W", "control.identification_sigma_K"})) {
    return "control.identification_ms = 0";
  }
  if (key == "estimator.window" && c.estimator.kind != EstimatorKind::kMhe && !many) {
    return c.estimator.kind == EstimatorKind::kEkf ? "estimator.kind = \"ekf\""
                                                   : "estimator.kind = \"posterior\"";
  }
  if (is({"estimator.choroid_sigma_initial", "estimator.choroid_min", "estimator.choroid_max",
          "estimator.choroid_process_noise"}) &&
      c.estimator.unknowns == Unknowns::kRpe && !many) {
    return "estimator.unknowns = \"rpe\"";
  }
  if (is({"safety.power_rise_max_W", "safety.energy_max_mJ", "safety.exposure_max_ms",
          "safety.thermal_dose_max", "safety.power_accuracy_relative",
          "safety.sample_gain_accuracy_relative"}) &&
      !c.safety.supervised) {
    return "safety.supervisor = \"off\"";
  }
  const bool beta = c.tissue.two_parameters();
  if (is({"model.choroid_min", "model.choroid_max", "estimator.choroid_initial"}) && !beta &&
      c.model.file.empty()) {
    return "no layer has scaled_by = \"beta\"";
  }
  if (is({"model.order", "model.method", "model.refinement", "model.parameter_dependence",
          "model.parameter_terms", "model.choroid_min", "model.choroid_max"}) &&
      !c.model.file.empty() && c.plant.model == PlantModel::kFull) {
    return "model.file is given";
  }
  if (key == "model.parameter_dependence" && c.model.reduction.method == ReductionMethod::kTaylor) {
    return "model.method = \"taylor\"";
  }
  if (key == "run.hold_ms" && c.run.goal != Goal::kHold) return "run.goal is not \"hold\"";
  if (key == "run.dose" && c.run.goal != Goal::kDose) return "run.goal is not \"dose\"";
  return {};
}

bool same_value(const Field& a, const Field& b) {
  return !value_text(a).empty() && value_text(a) == value_text(b);
}

std::vector<std::string> at_default(const Config& config) {
  Config given = config;
  Config plain;
  const std::vector<Field> all = fields(given);
  const std::vector<Field> defaults = fields(plain);
  std::vector<std::string> keys;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (same_value(all[i], defaults[i])) keys.push_back(all[i].key);
  }
  return keys;
}

[[noreturn]] void refuse(const std::string& key, const Place& place, std::string problem,
                         std::string found, std::string accepted) {
  throw Error(ErrorParts{.where = place.where,
                         .key = key,
                         .problem = std::move(problem),
                         .found = std::move(found),
                         .accepted = std::move(accepted)});
}

}  // namespace

bool uses(Use use, std::string_view key) noexcept {
  std::size_t longest = 0;
  std::uint32_t used_by = kAll;
  for (const Rule& rule : kRules) {
    if (!key.starts_with(rule.beginning) || rule.beginning.size() < longest) continue;
    longest = rule.beginning.size();
    used_by = rule.used_by;
  }
  return (used_by & static_cast<std::uint32_t>(use)) != 0;
}

std::vector<UnusedKey> unused_keys(const Config& config, const Places& places, Use use) {
  const std::vector<std::string> plain = at_default(config);
  std::vector<UnusedKey> unused;
  for (const auto& [key, place] : places) {
    if (std::find(plain.begin(), plain.end(), key) != plain.end()) continue;
    if (key.starts_with("prior.") || key == "prior_correlation") continue;  // "prior" says it
    if (!uses(use, key)) {
      unused.push_back({key, ""});
    } else if (std::string why = switched_off(config, key, use); !why.empty()) {
      unused.push_back({key, std::move(why)});
    }
  }
  return unused;
}

// Keys that an eye in a process of its own does not support.
void refuse_bench_keys(const Config& config, const Places& places, Use use) {
  const std::vector<std::string> plain = at_default(config);
  for (const auto& [key, place] : places) {
    const bool refused =
        std::any_of(std::begin(kRules), std::end(kRules), [&key = key, use](const Rule& rule) {
          return rule.beginning == key &&
                 (rule.used_by == kBench || (rule.used_by == kTold && use == Use::kTreatEye));
        });
    if (!refused || std::find(plain.begin(), plain.end(), key) != plain.end()) continue;
    refuse(key, place, "an eye of its own process measures and heats by its pulses",
           place.text.empty() ? "another value than the default" : place.text,
           "the default, or the simulated eye of the same process (no --device)");
  }
}

void refuse_contradictions(const Config& config, const Places& places, Use use) {
  if (use == Use::kTreatEye || use == Use::kEye) refuse_bench_keys(config, places, use);
  const auto option = [&places](const char* key) -> const Place* {
    const auto found = places.find(key);
    const bool is_option = found != places.end() && found->second.where.starts_with("--set ");
    return is_option ? &found->second : nullptr;
  };
  if (use == Use::kTreatEye) {
    const char* const eye = "an eye of its own process has pulses, and its samples are means";
    if (const Place* given = option("photoacoustics.sampling");
        given != nullptr && config.photoacoustics.sampling == Sampling::kInstant) {
      refuse("photoacoustics.sampling", *given, eye, "\"instant\"", "\"pulses\"");
    }
    if (const Place* given = option("plant.model");
        given != nullptr && config.plant.model == PlantModel::kReduced) {
      refuse("plant.model", *given, "an eye of its own process has no reduced model", "\"reduced\"",
             "\"full\"");
    }
    for (const char* key : {"tissue.volume_temperature", "plant.tissue.volume_temperature"}) {
      const Tissue& tissue = key[0] == 't' ? config.tissue : config.plant.tissue;
      const Place* given = option(key);
      if (given == nullptr || tissue.volume_temperature == VolumeTemperature::kNormalized) continue;
      refuse(key, *given, "pulses measure the normalized volume temperature",
             "\"absorption-weighted\"", "\"normalized\"");
    }
  }
  constexpr std::uint32_t kNoPulses = bits({Use::kSimulate, Use::kTreat}) | kMany;
  if ((kNoPulses & static_cast<std::uint32_t>(use)) != 0 &&
      config.photoacoustics.sampling == Sampling::kPulses) {
    const auto given = places.find("photoacoustics.sampling");
    refuse("photoacoustics.sampling", given == places.end() ? Place{} : given->second,
           "the eye in this process has no pulses", "\"pulses\"",
           "\"instant\", or treat --device eye");
  }
  if (use == Use::kSpots) {
    if (const Place* given = option("control.robust"); given != nullptr) {
      refuse("control.robust", *given, "spots compares both", "an option", "none");
    }
  }
}

}  // namespace photocoag
