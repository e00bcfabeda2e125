#include "photocoag/campaign/campaign_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "photocoag/config/table_reader.hpp"
#include "photocoag/config/usage.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/sha256.hpp"

namespace photocoag {
namespace {

// Its own [[input]], or the configuration's [[prior]].
Prior inputs_of(const Value& root, const Config& config) {
  const TableReader file(root, "");
  if (file.find("inputs") == nullptr) return read_prior(root, kInputTables);
  const Value& source = file.required("inputs");
  file.require(source.string == "prior", "inputs", "\"prior\", or [[input]] tables instead");
  for (const std::string_view own : {kInputTables.quantities, kInputTables.correlations}) {
    if (file.find(own) != nullptr) file.refuse(own, "none beside inputs = \"prior\"");
  }
  file.require(config.prior.declared(), "inputs", "a configuration that declares a [[prior]]");
  return config.prior;
}

}  // namespace

std::string Campaign::identity() const {
  return sha256_hex(text + to_toml(config) + std::string(source_hash()));
}

Campaign load_campaign(const std::string& file) {
  const Value root = read_toml_file(file);
  const TableReader table(root, "",
                          {"spots", "seed", "config", "set", "inputs", "input", "correlation"});
  Campaign campaign;
  campaign.file = file;
  campaign.text = read_file(file, 1'000'000);
  table.required("spots");
  campaign.spots = *table.count("spots", 1);
  campaign.seed = table.count("seed", 0).value_or(campaign.seed);
  std::string config_file = table.text("config");
  if (!config_file.empty()) {
    config_file =
        (std::filesystem::path(file).parent_path() / config_file).lexically_normal().string();
  }
  std::vector<UnusedKey> unused;  // a study may share its configuration with others
  campaign.config = load_config(config_file, table.texts("set"), Use::kSimulate, unused);
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
