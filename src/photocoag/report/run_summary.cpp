// summary.json and config.toml of a run folder.
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/report/run_log.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;  // keeps the file's order

std::string line_and_column(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte > 0 ? byte - 1 : 0, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t start = before.rfind('\n') + 1;  // npos + 1 is 0
  return fmt::format("{}:{}", line, before.size() - start + 1);
}

class Reader {
 public:
  Reader(const Json& object, const std::string& where) : object_(object), where_(where) {}

  std::optional<double> number(const char* key) const {
    const Json& value = find(key);
    if (value.is_null()) return {};
    if (!value.is_number()) fail(key, value, "a number or null");
    return value.get<double>();
  }
  std::optional<std::int64_t> count(const char* key) const {
    const Json& value = find(key);
    if (value.is_null()) return {};
    if (!value.is_number_integer() || value.get<std::int64_t>() < 0)
      fail(key, value, "a whole number, not negative, or null");
    return value.get<std::int64_t>();
  }
  std::optional<std::string> text(const char* key) const {
    const Json& value = find(key);
    if (value.is_null()) return {};
    if (!value.is_string()) fail(key, value, "a text or null");
    return value.get<std::string>();
  }
  template <class Value>
  Value required(const char* key, const std::optional<Value>& value) const {
    if (!value) fail(key, nullptr, "not null");
    return *value;
  }
  bool has(const char* key) const { return object_.contains(key); }
  const Json& find(const char* key) const {
    const auto found = object_.find(key);
    if (found == object_.end())
      throw Error({.where = where_, .key = key, .problem = "the key is missing"});
    return *found;
  }
  [[noreturn]] void fail(const char* key, const Json& value, std::string_view accepted) const {
    throw Error({.where = where_,
                 .key = key,
                 .problem = {},
                 .found = value.dump(),
                 .accepted = std::string(accepted)});
  }

 private:
  const Json& object_;
  const std::string& where_;
};

std::vector<RunSummary::Timing> read_timing(const Json& object) {
  std::vector<RunSummary::Timing> timing;
  const auto found = object.find("timing");
  if (found == object.end() || !found->is_object()) return timing;
  for (const auto& [name, values] : found->items()) {
    RunSummary::Timing row{.name = name, .values = {}};
    if (values.is_number()) row.values.emplace_back("value", values.get<double>());
    if (values.is_object())
      for (const auto& [statistic, value] : values.items())
        if (value.is_number()) row.values.emplace_back(statistic, value.get<double>());
    if (!row.values.empty()) timing.push_back(std::move(row));
  }
  return timing;
}

// Ascending bins of at least one entry; edges and counts small enough to add up.
bool are_bins(const Json& bins) {
  constexpr std::int64_t kMost = std::int64_t{1} << 40;
  const auto whole = [](const Json& value) {
    return value.is_number_integer() && value.get<std::int64_t>() >= 0 &&
           value.get<std::int64_t>() < kMost;
  };
  if (!bins.is_array()) return false;
  for (std::size_t k = 0; k < bins.size(); ++k) {
    const Json& bin = bins[k];
    if (!bin.is_array() || bin.size() != 2 || !whole(bin[0]) || !whole(bin[1])) return false;
    if (k > 0 && bin[0].get<std::int64_t>() <= bins[k - 1][0].get<std::int64_t>()) return false;
  }
  return true;
}

std::vector<RunSummary::Histogram> read_histograms(const Json& object, const std::string& where) {
  std::vector<RunSummary::Histogram> histograms;
  const auto found = object.find("histograms");
  if (found == object.end() || !found->is_object()) return histograms;
  for (const auto& [name, value] : found->items()) {
    const std::string place = fmt::format("{}: histograms.{}", where, name);
    if (!value.is_object())
      throw Error({.where = place, .found = value.dump(), .accepted = "an object with bins"});
    const Reader reader(value, place);
    const Json& bins = reader.find("bins");
    if (!are_bins(bins)) reader.fail("bins", bins, "[[lower edge, entries], …], ascending");
    RunSummary::Histogram histogram{.name = name,
                                    .bins = {},
                                    .below_0 = reader.count("below_0").value_or(0),
                                    .overflow = reader.count("overflow").value_or(0),
                                    .without = reader.count("without").value_or(0)};
    for (const Json& bin : bins) {
      histogram.bins.emplace_back(bin[0].get<std::int64_t>(), bin[1].get<std::int64_t>());
    }
    histograms.push_back(std::move(histogram));
  }
  return histograms;
}

std::vector<std::pair<std::string, double>> read_thermal_dose(const Json& object) {
  std::vector<std::pair<std::string, double>> doses;
  const auto found = object.find("thermal_dose");
  if (found == object.end() || !found->is_object()) return doses;
  for (const auto& [name, value] : found->items())
    if (value.is_number()) doses.emplace_back(name, value.get<double>());
  return doses;
}

std::optional<RunSummary::Device> read_device(const Json& object, const std::string& where) {
  const auto found = object.find("device");
  if (found == object.end() || !found->is_object()) return {};
  const Reader reader(*found, where + ": device");
  RunSummary::Device device;
  device.name = reader.text("name").value_or("");
  if (reader.has("pacing")) device.pacing = reader.text("pacing").value_or("");
  if (reader.has("late_commands")) device.late_commands = reader.count("late_commands");
  if (reader.has("pulse_peak_true_max_K")) {
    device.pulse_peak_true_max_K = reader.number("pulse_peak_true_max_K");
  }
  return device;
}

std::optional<RunSummary::Chance> read_chance(const Json& object, const std::string& where) {
  const auto found = object.find("chance");
  if (found == object.end() || !found->is_object()) return {};
  const Reader reader(*found, where + ": chance");
  const auto number = [&](const char* key) { return reader.required(key, reader.number(key)); };
  return RunSummary::Chance{number("limit_probability"), number("kept_deviations")};
}

double toml_number(const toml::table& table, std::string_view section, std::string_view key,
                   const std::string& where) {
  if (const auto value = table[section][key].value<double>()) return *value;
  throw Error({.where = where,
               .key = fmt::format("{}.{}", section, key),
               .problem = "the key is missing or not a number"});
}

}  // namespace

RunSummary parse_run_summary(std::string_view text, const std::string& where) {
  Json json;
  try {
    json = Json::parse(plain_text(std::string(text), where));
  } catch (const nlohmann::json::parse_error& problem) {
    throw Error({.where = fmt::format("{}:{}", where, line_and_column(text, problem.byte)),
                 .problem = "not valid JSON"});
  }
  if (!json.is_object())
    throw Error({.where = where, .found = json.type_name(), .accepted = "a JSON object"});
  const Reader reader(json, where);
  RunSummary summary;
  summary.peak_true_max_K = reader.number("peak_true_max_K");
  summary.peak_estimate_max_K = reader.number("peak_estimate_max_K");
  summary.limit_K = reader.required("limit_K", reader.number("limit_K"));
  summary.limit_violations = reader.count("limit_violations");
  summary.limit_active_cycles = reader.count("limit_active_cycles");
  summary.time_to_95_percent_s = reader.number("time_to_95_percent_s");
  summary.rms_error_after_50_ms_K = reader.number("rms_error_after_50_ms_K");
  summary.absorption_error_final = reader.number("absorption_error_final");
  if (reader.has("choroid_error_final")) {
    summary.choroid_error_final = reader.number("choroid_error_final");
  }
  summary.cycles = reader.required("cycles", reader.count("cycles"));
  summary.overruns = reader.count("overruns");
  summary.full_order_states = reader.count("full_order_states");
  summary.stopped_for = reader.text("stopped_for");
  const Json& seed = reader.find("seed");
  summary.seed = seed.is_string() ? seed.get<std::string>() : seed.dump();
  summary.config_sha256 = reader.text("config_sha256").value_or("");
  summary.version = reader.text("version").value_or("");
  summary.timing = read_timing(json);
  summary.histograms = read_histograms(json, where);
  summary.thermal_dose = read_thermal_dose(json);
  summary.device = read_device(json, where);
  summary.chance = read_chance(json, where);
  if (const auto check = json.find("prior_check"); check != json.end() && check->is_object()) {
    summary.prior_doubtful = check->value("doubtful", false);
  }
  return summary;
}

RunConfig parse_run_config(std::string_view text, const std::string& where) {
  RunConfig config;
  config.text = text;
  toml::table table;
  try {
    table = toml::parse(plain_text(config.text, where));
  } catch (const toml::parse_error& problem) {
    throw Error({.where = fmt::format("{}:{}:{}", where, problem.source().begin.line,
                                      problem.source().begin.column),
                 .problem = std::string(problem.description())});
  }
  config.peak_reference_K = toml_number(table, "control", "peak_reference_K", where);
  config.power_max_W = toml_number(table, "control", "power_max_W", where);
  config.ambient_C = toml_number(table, "tissue", "ambient_C", where);
  config.absorption_true = table["plant"]["absorption_factor"].value<double>();
  config.choroid_true = table["plant"]["choroid_factor"].value<double>();
  return config;
}

}  // namespace photocoag
