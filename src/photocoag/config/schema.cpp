#include "photocoag/config/schema.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "photocoag/config/fields.hpp"
#include "photocoag/config/random_quantities.hpp"
#include "photocoag/core/build_info.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

std::string name_of(const std::string& key) { return key.substr(key.find_last_of('.') + 1); }

Json number_in(const Range& range) {
  return {{"type", "number"},
          {range.above_low ? "exclusiveMinimum" : "minimum", range.low},
          {"maximum", range.high}};
}

Json array_of(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

// Properties, and no others.
Json closed_object(Json properties) {
  return {
      {"type", "object"}, {"properties", std::move(properties)}, {"additionalProperties", false}};
}

Json reference(std::string_view definition) {
  return {{"$ref", fmt::format("#/$defs/{}", definition)}};
}

Json type_of(const NumberField& field) { return number_in(field.range); }
Json type_of(const OptionalNumberField& field) { return number_in(field.range); }
Json type_of(const NumbersField& field) { return array_of(number_in(field.range)); }
Json type_of(const IntegerField& field) {
  return {{"type", "integer"}, {"minimum", field.low}, {"maximum", field.high}};
}
Json type_of(const WordField& field) { return {{"enum", field.words}}; }
Json type_of(const TextField& /*field*/) { return {{"type", "string"}}; }
// An array takes the place of all layers; a table changes those that it names.
Json type_of(const LayersField& /*field*/) {
  Json all = array_of(reference("layer"));
  all["minItems"] = 1;
  all["maxItems"] = 32;
  return {{"anyOf",
           {std::move(all),
            {{"type", "object"}, {"additionalProperties", reference("layer_change")}}}}};
}

Json schema_of(const Field& field) {
  Json schema = std::visit([](const auto& value) { return type_of(value); }, field.value);
  const std::string range = range_text(field);
  schema["description"] =
      range.empty() ? std::string(field.meaning) : fmt::format("{} ({})", field.meaning, range);
  const std::string value = value_text(field);
  if (!value.empty()) schema["default"] = Json::parse(value);
  return schema;
}

Json layer_properties() {
  Layer layer;
  Json properties = Json::object();
  for (const Field& field : layer_fields(layer, "layer")) {
    Json schema = schema_of(field);
    schema.erase("default");  // a layer's own depend on the tissue, and three have none
    properties[name_of(field.key)] = std::move(schema);
  }
  return properties;
}

// One of the distributions: its two parameters and no others.
Json quantity_with(std::string_view distribution, const std::vector<std::string>& parameters) {
  const Json any_number = {{"type", "number"}};
  const Json above_zero = {{"type", "number"}, {"exclusiveMinimum", 0}};
  Json properties = {{"key", {{"type", "string"}}},
                     {"distribution", {{"const", distribution}}},
                     {"low", any_number},
                     {"high", any_number},
                     {"use", {{"enum", {"estimated", "considered"}}}}};
  std::vector<std::string> required = {"key", "distribution", "low", "high"};
  for (const std::string& parameter : parameters) {
    properties[parameter] = parameter == "mean" ? any_number : above_zero;
    required.push_back(parameter);
  }
  Json schema = closed_object(std::move(properties));
  schema["required"] = std::move(required);
  return schema;
}

Json prior_schema() {
  Json quantity = {
      {"oneOf",
       {quantity_with("normal", {"mean", "sigma"}),
        quantity_with("log-normal", {"median", "sigma_log"}), quantity_with("uniform", {})}}};
  Json schema = array_of(std::move(quantity));
  schema["description"] = "what the controller believes of the eye before the first sample";
  return schema;
}

Json correlation_schema() {
  Json between = array_of({{"type", "string"}});
  between["minItems"] = 2;
  between["maxItems"] = 2;
  Json pair = closed_object(
      {{"between", std::move(between)},
       {"value", {{"type", "number"}, {"exclusiveMinimum", -1}, {"exclusiveMaximum", 1}}}});
  pair["required"] = {"between", "value"};
  return array_of(std::move(pair));
}

// The table of a section; "plant.tissue" lies within "plant".
Json& table_of(Json& root, std::string_view section) {
  const std::size_t dot = section.find('.');
  Json& table = root["properties"][std::string(section.substr(0, dot))];
  return dot == std::string_view::npos ? table : table_of(table, section.substr(dot + 1));
}

}  // namespace

std::string config_schema() {
  Json root = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
               {"title", fmt::format("photocoag {} configuration", version())},
               {"description", kResearchNotice}};
  root.update(closed_object(Json::object()));
  for (const Section& section : sections()) {
    table_of(root, section.name) = closed_object(Json::object());
    table_of(root, section.name)["description"] = section.meaning;
  }
  Config config;
  for (const Field& field : fields(config)) {
    const std::size_t dot = field.key.find_last_of('.');
    table_of(root, field.key.substr(0, dot))["properties"][field.key.substr(dot + 1)] =
        schema_of(field);
  }
  root["properties"][std::string(kPriorTables.quantities)] = prior_schema();
  root["properties"][std::string(kPriorTables.correlations)] = correlation_schema();
  Json layer = closed_object(layer_properties());
  layer["required"] = kRequiredLayerKeys;
  Json change = closed_object(layer_properties());
  change["properties"].erase("name");
  root["$defs"] = {{"layer", std::move(layer)}, {"layer_change", std::move(change)}};
  return root.dump(2) + "\n";
}

}  // namespace photocoag
