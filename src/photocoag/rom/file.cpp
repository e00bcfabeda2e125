#include "photocoag/rom/file.hpp"

#include <fmt/format.h>
#include <cmath>
#include <optional>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/rom/file_parts.hpp"
#include "photocoag/rom/uncertain_file.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kMaxBytes = 10'000'000;
constexpr int kMaxDepth = 16;  // of nested lists and objects; a model has four

Json vector_to_json(const StateVector& vector) {
  return Json(std::vector<double>(vector.data(), vector.data() + vector.size()));
}

Json tissue_to_json(const Tissue& tissue) {
  Json layers = Json::array();
  for (const Layer& layer : tissue.layers) {
    Json json = {{"name", layer.name},
                 {"thickness_m", layer.thickness},
                 {"absorption_per_m", layer.absorption},
                 {"scaled_by_alpha", layer.scaled_by == ScaledBy::kAlpha}};
    if (layer.conductivity) json["conductivity_W_per_mK"] = *layer.conductivity;
    if (layer.density) json["density_kg_per_m3"] = *layer.density;
    if (layer.heat_capacity) json["heat_capacity_J_per_kgK"] = *layer.heat_capacity;
    if (layer.scaled_by == ScaledBy::kBeta) json["scaled_by_beta"] = true;
    if (layer.perfusion != 0.0) json["perfusion_W_per_m3K"] = layer.perfusion;
    layers.push_back(std::move(json));
  }
  Json json = {{"ambient_C", tissue.ambient_celsius},
               {"domain_radius_m", tissue.domain_radius},
               {"spot_radius_m", tissue.spot_radius},
               {"transmission", tissue.transmission},
               {"density_kg_per_m3", tissue.density},
               {"heat_capacity_J_per_kgK", tissue.heat_capacity},
               {"conductivity_W_per_mK", tissue.conductivity},
               {"volume_temperature", to_string(tissue.volume_temperature)},
               {"peak_layer", tissue.peak_layer},
               {"layers", layers}};
  if (tissue.beam != BeamProfile::kFlatTop) json["beam"] = to_string(tissue.beam);
  if (tissue.beam == BeamProfile::kTable) {
    json["beam_radii_m"] = tissue.beam_radii;
    json["beam_intensities"] = tissue.beam_intensities;
  }
  return json;
}

// The flat top is not written.
void read_beam(const JsonReader& json, Tissue& tissue) {
  if (!json.has("beam")) return;
  const std::string beam = json["beam"].text();
  for (const auto profile : {BeamProfile::kFlatTop, BeamProfile::kGaussian, BeamProfile::kTable}) {
    if (beam == to_string(profile)) tissue.beam = profile;
  }
  json["beam"].expect(beam == to_string(tissue.beam), "\"flat-top\", \"gaussian\" or \"table\"");
  if (tissue.beam != BeamProfile::kTable) return;
  tissue.beam_radii = json["beam_radii_m"].numbers(kMaxBeamEntries);
  tissue.beam_intensities = json["beam_intensities"].numbers(kMaxBeamEntries);
}

ScaledBy read_scaled_by(const JsonReader& layer) {
  const bool by_alpha = layer["scaled_by_alpha"].boolean();
  const bool by_beta = layer.has("scaled_by_beta") && layer["scaled_by_beta"].boolean();
  layer["scaled_by_alpha"].expect(!(by_alpha && by_beta), "false beside scaled_by_beta");
  return by_alpha ? ScaledBy::kAlpha : by_beta ? ScaledBy::kBeta : ScaledBy::kNothing;
}

Tissue read_tissue(const JsonReader& json) {
  Tissue tissue;
  tissue.ambient_celsius = json["ambient_C"].number();
  tissue.domain_radius = json["domain_radius_m"].number();
  tissue.spot_radius = json["spot_radius_m"].number();
  read_beam(json, tissue);
  tissue.transmission = json["transmission"].number();
  tissue.density = json["density_kg_per_m3"].number();
  tissue.heat_capacity = json["heat_capacity_J_per_kgK"].number();
  tissue.conductivity = json["conductivity_W_per_mK"].number();
  const std::string volume = json["volume_temperature"].text();
  tissue.volume_temperature = volume == to_string(VolumeTemperature::kNormalized)
                                  ? VolumeTemperature::kNormalized
                                  : VolumeTemperature::kAbsorptionWeighted;
  json["volume_temperature"].expect(volume == to_string(tissue.volume_temperature),
                                    "\"absorption-weighted\" or \"normalized\"");
  tissue.peak_layer = json["peak_layer"].text();
  tissue.layers.clear();
  for (const JsonReader& layer : json["layers"].list(32)) {
    const auto optional = [&layer](const std::string& key) {
      return layer.has(key) ? std::optional<double>(layer[key].number()) : std::nullopt;
    };
    tissue.layers.push_back({.name = layer["name"].text(),
                             .thickness = layer["thickness_m"].number(),
                             .absorption = layer["absorption_per_m"].number(),
                             .scaled_by = read_scaled_by(layer),
                             .conductivity = optional("conductivity_W_per_mK"),
                             .density = optional("density_kg_per_m3"),
                             .heat_capacity = optional("heat_capacity_J_per_kgK"),
                             .perfusion = optional("perfusion_W_per_m3K").value_or(0.0)});
  }
  return tissue;
}

Discretization read_discretization(const JsonReader& json) {
  const std::string text = json.text();
  for (const auto how : kDiscretizations) {
    if (text == to_string(how)) return how;
  }
  json.expect(false, "\"zero-order-hold\", \"implicit-euler\" or \"tr-bdf2\"");
  return Discretization::kZeroOrderHold;
}

ParameterRange read_range(const JsonReader& json, std::string_view name, double highest) {
  json["name"].expect(json["name"].text() == name, fmt::format("\"{}\"", name));
  const ParameterRange range{.min = json["min"].number(), .max = json["max"].number()};
  json["max"].expect(range.min > 0.0 && range.max > range.min && range.max <= highest,
                     fmt::format("0 < min < max <= {}", highest));
  return range;
}

Json parameters_to_json(const ReducedModel& model) {
  Json list = Json::array();
  for (std::size_t q = 0; q < model.parameters.size(); ++q) {
    const ParameterRange& range = model.parameters[q];
    list.push_back({{"name", to_string(ScaledBy(q + 1))}, {"min", range.min}, {"max", range.max}});
  }
  return list;
}

// A short label that goes into printed lines.
std::string read_label(const JsonReader& json) {
  constexpr std::size_t kLongest = 80;
  std::string label = json.text();
  json.expect(label.size() <= kLongest, fmt::format("at most {} characters", kLongest));
  return label;
}

ReducedModel read_model(const JsonReader& json) {
  ReducedModel model;
  model.method = read_label(json["method"]);
  // Older files do not have it.
  if (json.has("refinement")) model.refinement = read_label(json["refinement"]);
  const std::vector<JsonReader> parameters = json["parameters"].list(kMaxParameters);
  json["parameters"].expect(!parameters.empty(), "\"alpha\", or \"alpha\" and \"beta\"");
  constexpr PerParameter kHighest = {10.0, 20.0};
  model.parameters.clear();
  for (std::size_t q = 0; q < parameters.size(); ++q) {
    model.parameters.push_back(read_range(parameters[q], to_string(ScaledBy(q + 1)), kHighest[q]));
  }
  model.theta = read_theta(json["theta"], parameters.size());
  // Older files do not have it.
  model.parameter_dependence = json.has("parameter_dependence")
                                   ? read_label(json["parameter_dependence"])
                                   : std::string(to_string(model.theta.kind));
  model.volume_normalized = json["volume_normalized"].boolean();
  model.whole = read_absorbed(json["absorbed_fraction"], parameters.size());
  const JsonReader continuous = json["continuous"];
  continuous["A"].matrix(model.A);
  json["order"].expect(json["order"].count() == static_cast<std::size_t>(model.A.rows()),
                       fmt::format("the {} rows of continuous.A", model.A.rows()));
  continuous["B"].matrix(model.B);
  continuous["C_volume"].matrix(model.C_volume);
  StateMatrix peak;
  continuous["C_peak"].matrix(peak);
  continuous["C_peak"].expect(peak.rows() == 1, "one row");
  model.C_peak = peak.row(0).transpose();
  const JsonReader discrete = json["discrete"];
  model.period = discrete["period_s"].number();
  model.discretization = read_discretization(discrete["discretization"]);
  discrete["A"].matrix(model.A_d);
  discrete["B"].matrix(model.B_d);
  model.tissue = read_tissue(json["tissue"]);
  model.full_order_states = json["full_order_states"].count();
  const JsonReader error = json["error"];
  model.error.absorption_factors = error["absorption_factors"].numbers(1000);
  model.error.peak = error["peak_relative"].numbers(1000);
  model.error.volume = error["volume_relative"].numbers(1000);
  const std::size_t checked = model.error.absorption_factors.size();
  std::vector<std::string> per_check = {"peak_relative", "volume_relative"};
  if (model.parameters.size() == 2) {
    model.error.choroid_factors = error["choroid_factors"].numbers(1000);
    per_check.emplace_back("choroid_factors");
  }
  for (const std::string& key : per_check) {
    error[key].expect(error[key].list(1000).size() == checked,
                      fmt::format("{} numbers, one for each of error.absorption_factors", checked));
  }
  error["peak_relative_max"].expect(error["peak_relative_max"].number() == model.error.peak_max(),
                                    "the largest of error.peak_relative");
  error["volume_relative_max"].expect(
      error["volume_relative_max"].number() == model.error.volume_max(),
      "the largest of error.volume_relative");
  model.error.duration = error["duration_s"].number();
  model.error.mean_dwell = error["mean_dwell_s"].number();
  model.error.seed = error["seed"].count();
  if (json.has("certificate")) model.certificate = read_certificate(json["certificate"]);
  if (json.has("uncertain")) {
    model.uncertain = std::make_shared<const UncertainModel>(
        read_uncertain(json["uncertain"], model.tissue, model.period));
  }
  return model;
}

// Stored twice: as the number of parameters and in the layers.
void check_parameters(const JsonReader& json, const ReducedModel& model) {
  json["parameters"].expect((model.parameters.size() == 2) == model.tissue.two_parameters(),
                            model.tissue.two_parameters()
                                ? "alpha and beta, because a layer has scaled_by_beta"
                                : "alpha alone, because no absorbing layer has scaled_by_beta");
}

// The normalisation is stored twice, for the online code and in the tissue: they must agree.
void check_normalization(const JsonReader& json, const ReducedModel& model) {
  const bool normalized = model.tissue.volume_temperature == VolumeTemperature::kNormalized;
  json["volume_normalized"].expect(
      model.volume_normalized == normalized,
      fmt::format("{}, because tissue.volume_temperature is \"{}\"", normalized,
                  to_string(model.tissue.volume_temperature)));
  const AbsorbedFraction whole = AbsorptionLaw(model.tissue).whole();
  // A few roundings of sums of at most 32 optical depths.
  const auto near = [](double a, double b) { return std::abs(a - b) <= 1e-12 * std::abs(b); };
  const auto all_near = [near](const PerParameter& a, const PerParameter& b) {
    return std::equal(a.begin(), a.end(), b.begin(), near);
  };
  json["absorbed_fraction"].expect(near(model.whole.fixed_front, whole.fixed_front) &&
                                       near(model.whole.fixed_back, whole.fixed_back) &&
                                       all_near(model.whole.front, whole.front) &&
                                       all_near(model.whole.back, whole.back),
                                   "the optical depths of the whole tissue");
}

// `json`: without its checksum.
std::string checksum(const Json& json) { return sha256_hex(json.dump()); }

}  // namespace

std::string to_json(const ReducedModel& model) {
  Json json = {
      {"format", "photocoag reduced model"},
      {"version", model.uncertain ? kUncertainModelFileVersion : kModelFileVersion},
      {"notice", kResearchNotice},
      {"program", {{"version", version()}, {"source_hash", source_hash()}}},
      {"method", model.method},
      {"refinement", model.refinement},
      {"order", model.order()},
      {"parameters", parameters_to_json(model)},
      {"parameter_dependence", model.parameter_dependence},
      {"theta", theta_to_json(model.theta, model.parameters.size())},
      {"volume_normalized", model.volume_normalized},
      {"absorbed_fraction", absorbed_to_json(model.whole, model.parameters.size())},
      {"continuous",
       {{"A", matrix_to_json(model.A)},
        {"B", matrix_to_json(model.B)},
        {"C_volume", matrix_to_json(model.C_volume)},
        {"C_peak", Json::array({vector_to_json(model.C_peak)})}}},
      {"discrete",
       {{"period_s", model.period},
        {"discretization", to_string(model.discretization)},
        {"A", matrix_to_json(model.A_d)},
        {"B", matrix_to_json(model.B_d)}}},
      {"tissue", tissue_to_json(model.tissue)},
      {"full_order_states", model.full_order_states},
      {"error",
       {{"meaning",
         "largest error over a run relative to the output's largest value in it; the worse of "
         "constant and random on/off power from cold tissue"},
        {"duration_s", model.error.duration},
        {"mean_dwell_s", model.error.mean_dwell},
        {"seed", model.error.seed},
        {"peak_relative_max", model.error.peak_max()},
        {"volume_relative_max", model.error.volume_max()},
        {"absorption_factors", model.error.absorption_factors},
        {"peak_relative", model.error.peak},
        {"volume_relative", model.error.volume}}},
  };
  if (model.parameters.size() == 2) json["error"]["choroid_factors"] = model.error.choroid_factors;
  if (model.certificate) json["certificate"] = certificate_to_json(*model.certificate);
  if (model.uncertain) json["uncertain"] = uncertain_to_json(*model.uncertain);
  json["checksum"] = checksum(json);
  return json.dump(1) + "\n";
}

ReducedModel from_json(std::string_view content, std::string_view where) {
  const std::string text = plain_text(std::string(content), std::string(where));
  Json json;
  try {
    // Copying and writing nested values recurses: a file of brackets must not end the program.
    json = Json::parse(text, [where](int depth, Json::parse_event_t, const Json&) {
      if (depth <= kMaxDepth) return true;
      throw Error(ErrorParts{.where = std::string(where),
                             .problem = "not a model file: nested too deeply",
                             .accepted = fmt::format("at most {} levels", kMaxDepth)});
    });
  } catch (const Json::exception& error) {
    throw Error(
        ErrorParts{.where = std::string(where),
                   .problem = fmt::format("not a complete model file (JSON): {}", error.what())});
  }
  const JsonReader reader(json, where);
  reader["format"].expect(reader["format"].text() == "photocoag reduced model",
                          "\"photocoag reduced model\"");
  const int expected = reader.has("uncertain") ? kUncertainModelFileVersion : kModelFileVersion;
  reader["version"].expect(
      reader["version"].count() == static_cast<std::size_t>(expected),
      fmt::format("version {}: make the model again with `photocoag reduce`", expected));
  const std::string stated = reader["checksum"].text();
  json.erase("checksum");
  if (stated != checksum(json)) {
    throw Error(ErrorParts{.where = std::string(where),
                           .key = "checksum",
                           .problem = "the model file was altered after it was made",
                           .found = stated.substr(0, 80),
                           .accepted =
                               "the SHA-256 of the file's content: make the model again with "
                               "`photocoag reduce`"});
  }
  try {
    ReducedModel model = read_model(reader);
    model.tissue.validate();
    check_parameters(reader, model);
    check_normalization(reader, model);
    verify(model);
    return model;
  } catch (const Error& error) {
    throw error.at(where);
  }
}

void save_reduced_model(const ReducedModel& model, const std::string& path) {
  write_file(path, to_json(model));
}

ReducedModel load_reduced_model(const std::string& path) {
  return from_json(read_file(path, kMaxBytes), path);
}

}  // namespace photocoag
