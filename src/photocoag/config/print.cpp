#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/config/decimal.hpp"
#include "photocoag/config/fields.hpp"
#include "photocoag/config/source.hpp"

namespace photocoag {
namespace {

constexpr std::string_view kHead =
    "# photocoag configuration, complete: `photocoag simulate --config FILE` repeats the run.\n"
    "# Research software, not a medical device.\n"
    "# The unit is in the name of each key; docs/configuration.md is the guide.\n";

std::string comment_text(const Field& field) {
  const std::string range = range_text(field);
  return fmt::format("{}{}{}", range, range.empty() ? "" : ": ", field.meaning);
}

// The width that most values of a column fit into; a few long ones may stick out.
std::size_t column_width(const std::vector<std::string>& cells, std::size_t most) {
  std::size_t width = 0;
  for (const std::string& cell : cells) {
    if (cell.size() <= most) width = std::max(width, cell.size());
  }
  return width;
}

std::string layer_line(const Layer& layer, std::size_t name_width, std::size_t thickness_width) {
  Layer copy = layer;
  const std::vector<Field> keys = layer_fields(copy, "");
  std::string text = fmt::format(
      "  {{ name = {:<{}} thickness_um = {:<{}} absorption_per_m = {}", value_text(keys[0]) + ",",
      name_width + 1, value_text(keys[1]) + ",", thickness_width + 1, value_text(keys[2]));
  // Only what differs from a layer that is like the tissue.
  Layer plain;
  const std::vector<Field> defaults = layer_fields(plain, "");
  for (std::size_t i = 3; i < keys.size(); ++i) {
    const std::string value = value_text(keys[i]);
    if (value == value_text(defaults[i])) continue;
    text += fmt::format(", {} = {}", keys[i].key.substr(1), value);
  }
  return text + " },\n";
}

std::string layers_text(std::string_view key, const Field& field) {
  constexpr std::size_t kWidest = 24;
  const std::vector<Layer>& layers = *std::get<LayersField>(field.value).layers;
  std::vector<std::string> names;
  std::vector<std::string> thicknesses;
  for (Layer layer : layers) {
    const std::vector<Field> keys = layer_fields(layer, "");
    names.push_back(value_text(keys[0]));
    thicknesses.push_back(value_text(keys[1]));
  }
  std::string comment(field.meaning);
  for (std::size_t at = 0; (at = comment.find('\n', at)) != std::string::npos; ++at) {
    comment.insert(at + 1, "# ");
  }
  std::string text = fmt::format("# {}\n{} = [\n", comment, key);
  for (const Layer& layer : layers) {
    text += layer_line(layer, column_width(names, kWidest), column_width(thicknesses, kWidest));
  }
  return text + "]\n";
}

std::string section_text(const Section& section, const std::vector<Field>& all) {
  constexpr std::size_t kWidest = 24;
  std::vector<const Field*> own;
  std::vector<std::string> keys;
  std::vector<std::string> values;
  for (const Field& field : all) {
    const std::size_t dot = field.key.find_last_of('.');
    if (field.key.substr(0, dot) != section.name) continue;
    own.push_back(&field);
    keys.push_back(field.key.substr(dot + 1));
    values.push_back(value_text(field));
  }
  std::string text = fmt::format("\n# {}\n[{}]\n", section.meaning, section.name);
  for (std::size_t i = 0; i < own.size(); ++i) {
    text += std::holds_alternative<LayersField>(own[i]->value)
                ? layers_text(keys[i], *own[i])
                : fmt::format("{:<{}} = {:<{}}  # {}\n", keys[i], column_width(keys, 80), values[i],
                              column_width(values, kWidest), comment_text(*own[i]));
  }
  return text;
}

std::string quantity_text(const RandomQuantity& q) {
  const auto line = [](std::string_view key, const std::string& value) {
    return fmt::format("{:<12} = {}\n", key, value);
  };
  const auto number = [&line](std::string_view key, double value) {
    return line(key, shortest_decimal(value, 0));
  };
  std::string text = "\n[[prior]]\n" + line("key", toml_quoted(q.key));
  switch (q.distribution) {
    case Distribution::kNormal:
      text += line("distribution", toml_quoted("normal")) + number("mean", q.center) +
              number("sigma", q.spread);
      break;
    case Distribution::kLogNormal:
      text += line("distribution", toml_quoted("log-normal")) + number("median", q.center) +
              number("sigma_log", q.spread);
      break;
    case Distribution::kUniform:
      text += line("distribution", toml_quoted("uniform"));
      break;
  }
  return text + number("low", q.low) + number("high", q.high) +
         line("use", toml_quoted(q.considered ? "considered" : "estimated"));
}

std::string prior_text(const Prior& prior) {
  if (!prior.declared()) return "";
  std::string text =
      "\n# what the controller believes of the eye before the first sample; units: the keys'\n";
  for (const RandomQuantity& q : prior.quantities)
    text += quantity_text(q).substr(q == prior.quantities.front() ? 1 : 0);
  for (const Correlation& pair : prior.correlations) {
    text += fmt::format("\n[[prior_correlation]]\nbetween = [{}, {}]\nvalue   = {}\n",
                        toml_quoted(pair.first), toml_quoted(pair.second),
                        shortest_decimal(pair.value, 0));
  }
  return text;
}

}  // namespace

std::string to_toml(const Config& config) {
  Config copy = config;  // fields are bound to variables
  const std::vector<Field> all = fields(copy);
  const bool differs = config.plant.tissue_differs || config.plant.tissue != config.tissue;
  std::string text(kHead);
  for (const Section& section : sections()) {
    if (section.name == "plant.tissue" && !differs) continue;
    text += section_text(section, all);
    if (section.name == "uncertainty") text += prior_text(config.prior);
  }
  return text;
}

}  // namespace photocoag
