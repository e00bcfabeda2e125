#include "photocoag/campaign/campaign_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <utility>

#include "photocoag/config/fields.hpp"
#include "photocoag/config/source.hpp"
#include "photocoag/config/usage.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/core/sha256.hpp"

namespace photocoag {
namespace {

[[noreturn]] void refuse(const Value& value, const std::string& key, std::string accepted) {
  throw Error(ErrorParts{
      .where = value.where, .key = key, .found = value.text, .accepted = std::move(accepted)});
}

const Value& required(const Value& table, std::string_view key) {
  const Value* found = table.find(key);
  if (found == nullptr) {
    throw Error(
        ErrorParts{.where = table.where, .key = std::string(key), .problem = "the key is missing"});
  }
  return *found;
}

std::string text_of(const Value& value, const std::string& key) {
  if (value.kind != Value::Kind::kString) refuse(value, key, "a string");
  return value.string;
}

double number_of(const Value& table, std::string_view key) {
  const Value& value = required(table, key);
  if (value.kind == Value::Kind::kInteger) return static_cast<double>(value.integer);
  if (value.kind != Value::Kind::kFloat || !std::isfinite(value.number)) {
    refuse(value, std::string(key), "a finite number");
  }
  return value.number;
}

// All results are in memory in the end.
constexpr std::uint64_t kMostSpots = 10'000'000;

std::uint64_t count_of(const Value& value, const std::string& key, std::int64_t low) {
  if (value.kind != Value::Kind::kInteger || value.integer < low) {
    refuse(value, key, fmt::format("a whole number from {} on", low));
  }
  return static_cast<std::uint64_t>(value.integer);
}

void only(const Value& table, std::initializer_list<std::string_view> keys) {
  for (const Entry& entry : table.entries) {
    if (std::find(keys.begin(), keys.end(), entry.key) != keys.end()) continue;
    throw Error(ErrorParts{.where = entry.value.where,
                           .key = entry.key,
                           .problem = "unknown key",
                           .accepted = fmt::format("{}", fmt::join(keys, ", "))});
  }
}

const std::vector<Entry>& items(const Value& root, std::string_view key) {
  static const std::vector<Entry> none;
  const Value* found = root.find(key);
  if (found == nullptr) return none;
  if (found->kind != Value::Kind::kArray) refuse(*found, std::string(key), "an array");
  return found->entries;
}

CampaignInput read_input(const Value& table) {
  if (table.kind != Value::Kind::kTable) refuse(table, "input", "a table");
  only(table, {"key", "distribution", "mean", "median", "sigma", "sigma_log", "low", "high"});
  CampaignInput input;
  input.key = text_of(required(table, "key"), "key");
  const Value& word = required(table, "distribution");
  const std::string distribution = text_of(word, "distribution");
  input.low = number_of(table, "low");
  input.high = number_of(table, "high");
  if (!(input.low <= input.high)) refuse(required(table, "high"), "high", "at least low");
  if (distribution == "normal") {
    input.distribution = Distribution::kNormal;
    input.center = number_of(table, "mean");
    input.spread = number_of(table, "sigma");
  } else if (distribution == "log-normal") {
    input.distribution = Distribution::kLogNormal;
    input.center = number_of(table, "median");
    input.spread = number_of(table, "sigma_log");
    if (!(input.center > 0.0)) refuse(required(table, "median"), "median", "above 0");
  } else if (distribution != "uniform") {
    refuse(word, "distribution", "normal, log-normal or uniform");
  }
  if (input.distribution != Distribution::kUniform) {
    if (!(input.spread >= 0.0)) refuse(word, "sigma", "0 or more");
    if (!(input.low <= input.center && input.center <= input.high)) {
      refuse(word, "mean or median", "between low and high");
    }
  }
  return input;
}

Eigen::MatrixXd read_correlation(const Value& root, const std::vector<CampaignInput>& inputs) {
  const auto size = static_cast<Eigen::Index>(inputs.size());
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(size, size);
  for (const Entry& entry : items(root, "correlation")) {
    only(entry.value, {"between", "value"});
    const std::vector<Entry>& pair = items(entry.value, "between");
    std::vector<Eigen::Index> index;
    for (const Entry& name : pair) {
      const std::string key = text_of(name.value, "between");
      for (std::size_t i = 0; i < inputs.size(); ++i) {
        if (inputs[i].key == key) index.push_back(static_cast<Eigen::Index>(i));
      }
    }
    if (pair.size() != 2 || index.size() != 2 || index[0] == index[1]) {
      refuse(entry.value, "correlation.between", "two keys of inputs");
    }
    const double value = number_of(entry.value, "value");
    if (!(std::abs(value) < 1.0)) refuse(entry.value, "correlation.value", "above -1, below 1");
    correlation(index[0], index[1]) = correlation(index[1], index[0]) = value;
  }
  std::optional<Eigen::MatrixXd> factor = cholesky(correlation);
  if (!factor) {
    refuse(root, "correlation", "correlations that are possible together (positive definite)");
  }
  return *std::move(factor);
}

// Streams of the random numbers of campaigns; core/random.hpp has those below 1000.
constexpr std::uint32_t kFirstInputStream = 1000;
constexpr std::uint32_t kSeedStream = 999;
constexpr std::uint32_t kMostAttempts = 10'000;

double value_of(const CampaignInput& input, double normal) {
  switch (input.distribution) {
    case Distribution::kNormal:
      return input.center + input.spread * normal;
    case Distribution::kLogNormal:
      return input.center * std::exp(input.spread * normal);
    case Distribution::kUniform:
      break;
  }
  const double probability = 0.5 * std::erfc(-normal / std::numbers::sqrt2);
  return input.low + (input.high - input.low) * probability;
}

}  // namespace

std::string Campaign::identity() const {
  return sha256_hex(text + to_toml(config) + std::string(source_hash()));
}

Campaign load_campaign(const std::string& file) {
  const Value root = read_toml_file(file);
  only(root, {"spots", "seed", "config", "set", "input", "correlation"});
  Campaign campaign;
  campaign.file = file;
  campaign.text = read_file(file, 1'000'000);
  campaign.spots = count_of(required(root, "spots"), "spots", 1);
  if (campaign.spots > kMostSpots) {
    refuse(required(root, "spots"), "spots", fmt::format("at most {}", kMostSpots));
  }
  if (const Value* seed = root.find("seed")) campaign.seed = count_of(*seed, "seed", 0);
  std::string config_file;
  if (const Value* config = root.find("config")) {
    config_file = (std::filesystem::path(file).parent_path() / text_of(*config, "config"))
                      .lexically_normal()
                      .string();
  }
  std::vector<std::string> set;
  for (const Entry& entry : items(root, "set")) set.push_back(text_of(entry.value, "set"));
  std::vector<UnusedKey> unused;  // a study may share its configuration with others
  campaign.config = load_config(config_file, set, Use::kSimulate, unused);
  for (const Entry& entry : items(root, "input")) {
    campaign.inputs.push_back(read_input(entry.value));
    for (std::size_t i = 0; i + 1 < campaign.inputs.size(); ++i) {
      if (campaign.inputs[i].key == campaign.inputs.back().key) {
        refuse(entry.value, campaign.inputs.back().key, "each key once");
      }
    }
  }
  campaign.correlation_root = read_correlation(root, campaign.inputs);
  try {
    for (const bool highest : {false, true}) {
      Config config = campaign.config;
      InputSetter setter(campaign, config);
      std::vector<double> values;
      for (const CampaignInput& input : campaign.inputs) {
        values.push_back(highest ? input.high : input.low);
      }
      setter.set(values);
      config.validate();
    }
    draw_inputs(campaign, 0);
  } catch (const Error& error) {
    throw error.at(file);
  }
  return campaign;
}

std::vector<double> draw_inputs(const Campaign& campaign, std::uint64_t spot) {
  const std::size_t size = campaign.inputs.size();
  Eigen::VectorXd normal(static_cast<Eigen::Index>(size));
  std::vector<double> values(size);
  // Outside the bounds: all anew, which is the joint distribution truncated to them.
  for (std::uint32_t attempt = 0; attempt < kMostAttempts; ++attempt) {
    for (std::size_t i = 0; i < size; ++i) {
      const auto stream =
          static_cast<RandomStream>(kFirstInputStream + attempt * static_cast<std::uint32_t>(size) +
                                    static_cast<std::uint32_t>(i));
      normal[static_cast<Eigen::Index>(i)] = standard_normal(campaign.seed, spot, stream);
    }
    const Eigen::VectorXd correlated = campaign.correlation_root * normal;
    bool inside = true;
    for (std::size_t i = 0; i < size; ++i) {
      values[i] = value_of(campaign.inputs[i], correlated[static_cast<Eigen::Index>(i)]);
      inside =
          inside && values[i] >= campaign.inputs[i].low && values[i] <= campaign.inputs[i].high;
    }
    if (inside) return values;
  }
  throw Error(ErrorParts{.where = campaign.file,
                         .problem = "the bounds of the inputs are hardly ever met",
                         .accepted = "bounds with some probability between them"});
}

std::uint64_t noise_seed(const Campaign& campaign, std::uint64_t spot) noexcept {
  return static_cast<std::uint64_t>(
      uniform(campaign.seed, spot, static_cast<RandomStream>(kSeedStream)) * 0x1.0p53);
}

InputSetter::InputSetter(const Campaign& campaign, Config& config) {
  std::vector<Field> known = fields(config);
  for (Layer& layer : config.plant.tissue.layers) {
    for (Field& field : layer_fields(layer, "plant.tissue.layers." + layer.name)) {
      known.push_back(std::move(field));
    }
  }
  for (const CampaignInput& input : campaign.inputs) {
    if (input.key == kCalibrationFactor) {
      targets_.push_back({&factor_, 1.0});
      continue;
    }
    if (input.key == kCalibrationOffset) {
      targets_.push_back({&offset_, 1.0});
      continue;
    }
    if (input.key == kDelay) {
      targets_.push_back({&delay_, 1.0});
      continue;
    }
    double* value = nullptr;
    double scale = 1.0;
    for (const Field& field : known) {
      if (field.key != input.key || !field.key.starts_with("plant.")) continue;
      if (const auto* number = std::get_if<NumberField>(&field.value)) {
        value = number->value;
        scale = std::pow(10.0, number->unit.exponent);
      }
    }
    if (value == nullptr) {
      throw Error(ErrorParts{.key = "input.key",
                             .found = input.key,
                             .accepted = "a number of the eye, e.g. plant.absorption_factor, "
                                         "plant.noise_K, plant.tissue.spot_radius_um, "
                                         "plant.tissue.layers.RPE.thickness_um, or "
                                         "calibration_factor, calibration_offset_K, delay_cycles"});
    }
    targets_.push_back({value, scale});
  }
}

std::optional<int> InputSetter::delay() const noexcept {
  if (!std::isfinite(delay_)) return std::nullopt;
  return std::clamp(static_cast<int>(std::lround(delay_)), 0, 1);
}

void InputSetter::set(const std::vector<double>& values) noexcept {
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    *targets_[i].value = values[i] * targets_[i].scale;
  }
}

}  // namespace photocoag
