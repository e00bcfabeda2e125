#include "photocoag/config/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "photocoag/config/belief.hpp"
#include "photocoag/config/fields.hpp"
#include "photocoag/config/random_quantities.hpp"
#include "photocoag/config/reader.hpp"
#include "photocoag/config/source.hpp"
#include "photocoag/config/usage.hpp"
#include "photocoag/core/check.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/sha256.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

constexpr double kMostCycles = 1e6;

std::string folder_of(const std::string& file) {
  std::error_code error;
  const fs::path path = fs::absolute(file.empty() ? fs::path(".") : fs::path(file), error);
  if (error) throw Error({.where = file, .problem = "no current folder: " + error.message()});
  return (file.empty() ? path : path.parent_path()).lexically_normal().string();
}

std::vector<Source> read_all(const std::string& file, const std::vector<std::string>& overrides) {
  std::vector<Source> sources;
  if (!file.empty()) sources.push_back({read_toml_file(file), folder_of(file)});
  for (const std::string& option : overrides) {
    sources.push_back({read_override(option), folder_of("")});
  }
  return sources;
}

bool mentions(std::string_view text, std::string_view key) {
  const std::size_t at = text.find(key);
  return at != std::string_view::npos && (at == 0 || text[at - 1] != '.');
}

// Place to report for an error in `key`: its own; else that of a key mentioned in the error or
// below `key`, the last one given; else that of [tissue], from which the plant inherits it.
const Place* place_of(const std::string& key, const std::string& accepted, const Places& places) {
  if (const auto own = places.find(key); own != places.end()) return &own->second;
  const Place* last = nullptr;
  for (const auto& [other, place] : places) {
    const bool related = other.starts_with(key + ".") || mentions(accepted, other);
    if (related && (last == nullptr || place.order > last->order)) last = &place;
  }
  constexpr std::string_view kPlant = "plant.";
  if (last != nullptr || !key.starts_with("plant.tissue.")) return last;
  return place_of(key.substr(kPlant.size()), accepted, places);
}

// The posterior excludes other settings for the same purpose.
void require_valid_chance(const Config& config) {
  if (config.control.robust != Robustness::kChance) return;
  require(config.prior.declared(), "control.robust", std::string_view("\"chance\""),
          "\"none\" or \"certified\"; \"chance\" needs a [[prior]]");
  require(!config.uncertainty.declared(), "control.robust", std::string_view("\"chance\""),
          "\"certified\" with [uncertainty], or \"chance\" with [[prior]] alone");
  require(config.estimator.kind != EstimatorKind::kMhe, "estimator.kind",
          std::string_view("\"mhe\""), "\"posterior\" with control.robust = \"chance\"");
}

void require_valid_posterior(const Config& config) {
  if (!config.uses_prior()) return;
  require(config.prior.declared(), "estimator.kind", std::string_view("\"posterior\""),
          "\"ekf\" or \"mhe\"; \"posterior\" needs a [[prior]]");
  require(config.estimator.unknowns == Unknowns::kRpe, "estimator.unknowns",
          std::string_view("\"rpe-and-choroid\""),
          "\"rpe\" with estimator.kind = \"posterior\": a [[prior]] of the choroid's "
          "absorption_per_m instead");
  require(config.model.discretization == Discretization::kZeroOrderHold, "model.discretization",
          to_string(config.model.discretization),
          "\"zero-order-hold\" with estimator.kind = \"posterior\"");
  const IntersampleTiming& timing = config.estimator.timing;
  require(timing.averaging == 0.0, "estimator.sample_averaging_periods", timing.averaging,
          "0 with estimator.kind = \"posterior\"");
  require(timing.sample_lag == 0.0, "estimator.sample_lag_periods", timing.sample_lag,
          "0 with estimator.kind = \"posterior\"");
  require(timing.power_lag == 0.0, "estimator.power_lag_periods", timing.power_lag,
          "0 with estimator.kind = \"posterior\"");
}

// Adds the place and the number as written, which validate() does not know.
Error with_place(const Error& error, const Places& places) {
  ErrorParts parts = error.parts();
  const auto own = places.find(parts.key);
  const Place* place = place_of(parts.key, parts.accepted, places);
  parts.where = place == nullptr ? "default" : place->where;
  if (own != places.end() && !own->second.text.empty()) parts.found = own->second.text;
  return Error(std::move(parts));
}

}  // namespace

std::size_t Config::cycles() const noexcept {
  return static_cast<std::size_t>(std::max(1.0, std::round(run.duration / control.period)));
}

namespace {

void validate_bench(const Config& c) {
  const BenchSettings& bench = c.plant.bench;
  if (bench.needs_intersample()) {
    require(c.plant.discretization == Discretization::kZeroOrderHold, "plant.discretization",
            to_string(c.plant.discretization),
            "\"zero-order-hold\" with lags, averaging or drift of the plant: they need an eye that "
            "is exact in time");
    require(c.plant.model == PlantModel::kReduced || c.plant.tissue.uniform_conduction(),
            "plant.tissue.layers", std::string_view("layers that conduct differently"),
            "layers that conduct alike with lags, averaging or drift of the plant");
  }
  // The mean over a period differs from the power that acts after the lag.
  require(c.estimator.timing.power_lag == 0.0 || bench.readback == PowerReadback::kNone,
          "plant.power_readback", std::string_view("emitted"),
          "\"none\" with estimator.power_lag_periods: a mean over the period hides when it acts");
}

}  // namespace

void Config::validate() const {
  Config own = *this;
  require_in_range(fields(own));
  control.validate();
  estimator.validate();
  model.reduction.validate();
  // The margin's search fixes beta at its initial estimate.
  require(!uncertainty.declared() || estimator.unknowns == Unknowns::kRpe, "estimator.unknowns",
          std::string_view("rpe-and-choroid"), "\"rpe\" where [uncertainty] declares anything");
  tissue.validate("tissue");
  plant.tissue.validate("plant.tissue");
  validate_bench(*this);
  require(plant.choroid_factor == 1.0 || plant.tissue.two_parameters(), "plant.choroid_factor",
          plant.choroid_factor,
          "1, or an absorbing layer with scaled_by = \"beta\": nothing else depends on it");
  require(estimator.unknowns == Unknowns::kRpe || !model.file.empty() || tissue.two_parameters(),
          "estimator.unknowns", std::string_view("rpe-and-choroid"),
          "\"rpe\", or an absorbing layer of [tissue] with scaled_by = \"beta\"");
  require(run.duration >= control.period, "run.duration_ms", run.duration * 1e3,
          fmt::format("at least one period, control.period_ms = {} ms", control.period * 1e3));
  require(run.duration <= kMostCycles * control.period, "run.duration_ms", run.duration * 1e3,
          fmt::format("at most {} periods of control.period_ms = {} ms", kMostCycles,
                      control.period * 1e3));
  validate_prior(*this);
  require_valid_chance(*this);
  require_valid_posterior(*this);
}

bool Config::uses_prior() const noexcept {
  return estimator.kind == EstimatorKind::kPosterior || control.robust == Robustness::kChance;
}

Config config_of(const std::vector<Source>& sources, Places& places) {
  Config config;
  places = read_sources(sources, config);
  try {
    config.validate();
    if (config.uses_prior()) {
      config.estimator.kind = EstimatorKind::kPosterior;  // the only one that knows a quantile
      config.estimator.prior = belief_of(config.prior, config.estimator);
    }
  } catch (const Error& error) {
    throw with_place(error, places);
  }
  return config;
}

Config load_config(const std::string& file, const std::vector<std::string>& overrides) {
  Places places;
  return config_of(read_all(file, overrides), places);
}

Config load_config(const std::string& file, const std::vector<std::string>& overrides, Use use,
                   std::vector<UnusedKey>& unused) {
  Places places;
  const Config config = config_of(read_all(file, overrides), places);
  refuse_contradictions(config, places, use);
  unused = unused_keys(config, places, use);
  return config;
}

std::string config_sha256(const Config& config) { return sha256_hex(to_toml(config)); }

}  // namespace photocoag
