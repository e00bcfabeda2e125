#include "photocoag/campaign/campaign_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

#include "photocoag/config/source.hpp"
#include "photocoag/config/usage.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/linear_algebra.hpp"
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

// Its own [[input]], or the configuration's [[prior]].
Prior inputs_of(const Value& root, const Config& config) {
  const Value* const source = root.find("inputs");
  if (source == nullptr) return read_prior(root, kInputTables);
  if (source->kind != Value::Kind::kString || source->string != "prior") {
    refuse(*source, "inputs", "\"prior\", or [[input]] tables instead");
  }
  for (const std::string_view own : {kInputTables.quantities, kInputTables.correlations}) {
    if (root.find(own) == nullptr) continue;
    refuse(*root.find(own), std::string(own), "none beside inputs = \"prior\"");
  }
  if (!config.prior.declared()) {
    refuse(*source, "inputs", "a configuration that declares a [[prior]]");
  }
  return config.prior;
}

}  // namespace

std::string Campaign::identity() const {
  return sha256_hex(text + to_toml(config) + std::string(source_hash()));
}

Campaign load_campaign(const std::string& file) {
  const Value root = read_toml_file(file);
  only(root, {"spots", "seed", "config", "set", "inputs", "input", "correlation"});
  Campaign campaign;
  campaign.file = file;
  campaign.text = read_file(file, 1'000'000);
  campaign.spots = count_of(required(root, "spots"), "spots", 1);
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
  const Prior inputs = inputs_of(root, campaign.config);
  campaign.inputs = inputs.quantities;
  try {
    campaign.correlation_root = *cholesky(correlation_matrix(inputs, kInputTables));
    for (const bool highest : {false, true}) {
      Config config = campaign.config;
      InputSetter setter(campaign, config);
      std::vector<double> values;
      for (const RandomQuantity& input : campaign.inputs) {
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

std::string_view input_unit(std::string_view key) noexcept {
  for (const auto& [ending, unit] : {std::pair<std::string_view, std::string_view>{"_um", "um"},
                                     {"_per_mK", "W/(m K)"},
                                     {"_per_m", "1/m"},
                                     {"_K", "K"}}) {
    if (key.ends_with(ending)) return unit;
  }
  return "1";
}

std::string short_name(const std::string& key) {
  std::string name = key;
  for (const std::string_view part : {"plant.", "tissue.", "layers."}) {
    if (name.starts_with(part)) name.erase(0, part.size());
  }
  return name;
}

}  // namespace photocoag
