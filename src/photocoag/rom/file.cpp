#include "photocoag/rom/file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/sha256.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxBytes = 10'000'000;
constexpr std::size_t kMaxNodes = 10'000;

template <typename Matrix>
Json matrix_to_json(const Matrix& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(std::move(row));
  }
  return rows;
}

Json vector_to_json(const StateVector& vector) {
  return Json(std::vector<double>(vector.data(), vector.data() + vector.size()));
}

Json absorbed_to_json(const AbsorbedFraction& a) {
  return {{"fixed_front", a.fixed_front},
          {"scaled_front", a.scaled_front},
          {"fixed_back", a.fixed_back},
          {"scaled_back", a.scaled_back}};
}

Json theta_to_json(const Theta& theta) {
  if (theta.kind == ThetaKind::kDeim) {
    Json points = Json::array();
    for (int j = 0; j < theta.terms; ++j) points.push_back(absorbed_to_json(theta.points[j]));
    return {{"kind", to_string(theta.kind)}, {"points", points}};
  }
  Json json = {{"kind", to_string(theta.kind)}, {"terms", theta.terms}, {"center", theta.center}};
  if (theta.kind == ThetaKind::kChebyshev) json["half_width"] = theta.half_width;
  return json;
}

Json output_certificate_to_json(const OutputCertificate& output) {
  return {{"bound_relative_max", output.relative_max()},
          {"treatment_bound_relative_max", output.treatment_relative_max()},
          {"bound_K_per_W", output.bound},
          {"bound_relative", output.relative},
          {"treatment_bound_K_per_W", output.treatment_bound},
          {"treatment_bound_relative", output.treatment_relative},
          {"sum_K_per_W", output.sum},
          {"scale_K_per_W", output.scale},
          {"majorant", output.majorant}};
}

Json certificate_to_json(const ErrorCertificate& certificate) {
  return {{"meaning",
           "both models from cold tissue, the same alpha and powers from 0 to u_max: the outputs "
           "differ by at most u_max * bound at every sample instant"},
          {"absorption_factors", certificate.absorption_factors},
          {"treatment_duration_s", certificate.treatment_duration},
          {"horizon_periods", certificate.horizon},
          {"tail_relative", certificate.tail_relative},
          {"decay_per_period", certificate.decay},
          {"peak", output_certificate_to_json(certificate.peak)},
          {"volume", output_certificate_to_json(certificate.volume)}};
}

Json tissue_to_json(const Tissue& tissue) {
  Json layers = Json::array();
  for (const Layer& layer : tissue.layers) {
    layers.push_back({{"name", layer.name},
                      {"thickness_m", layer.thickness},
                      {"absorption_per_m", layer.absorption},
                      {"scaled_by_alpha", layer.scaled_by_alpha}});
  }
  return {{"ambient_C", tissue.ambient_celsius},
          {"domain_radius_m", tissue.domain_radius},
          {"spot_radius_m", tissue.spot_radius},
          {"transmission", tissue.transmission},
          {"density_kg_per_m3", tissue.density},
          {"heat_capacity_J_per_kgK", tissue.heat_capacity},
          {"conductivity_W_per_mK", tissue.conductivity},
          {"volume_temperature", to_string(tissue.volume_temperature)},
          {"peak_layer", tissue.peak_layer},
          {"layers", layers}};
}

// Reads fields and names the one that is missing or wrong, by its path in the file.
class Reader {
 public:
  Reader(const Json& json, std::string_view where, std::string path = {})
      : json_(json), where_(where), path_(std::move(path)) {}

  Reader operator[](const std::string& key) const {
    const std::string path = path_.empty() ? key : path_ + "." + key;
    if (!json_.is_object() || !json_.contains(key)) {
      throw Error(
          ErrorParts{.where = where_, .key = path, .problem = "missing from the model file"});
    }
    return Reader(json_.at(key), where_, path);
  }

  bool has(const std::string& key) const { return json_.is_object() && json_.contains(key); }

  double number() const {
    expect(json_.is_number(), "a number");
    return json_.get<double>();
  }
  std::size_t count() const {
    expect(json_.is_number_unsigned(), "a whole number, not negative");
    return json_.get<std::size_t>();
  }
  bool boolean() const {
    expect(json_.is_boolean(), "true or false");
    return json_.get<bool>();
  }
  std::string text() const {
    expect(json_.is_string(), "a text");
    return json_.get<std::string>();
  }
  std::vector<Reader> list(std::size_t max_size) const {
    expect(json_.is_array() && json_.size() <= max_size,
           fmt::format("a list of at most {}", max_size));
    std::vector<Reader> items;
    for (std::size_t i = 0; i < json_.size(); ++i) {
      items.emplace_back(json_.at(i), where_, fmt::format("{}[{}]", path_, i));
    }
    return items;
  }
  std::vector<double> numbers(std::size_t max_size) const {
    std::vector<double> values;
    for (const Reader& item : list(max_size)) values.push_back(item.number());
    return values;
  }
  template <typename Matrix>
  void matrix(Matrix& out) const {
    const std::vector<Reader> rows = list(Matrix::MaxRowsAtCompileTime);
    expect(!rows.empty(), "at least one row");
    const std::size_t columns = rows[0].list(Matrix::MaxColsAtCompileTime).size();
    out.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::vector<double> row = rows[i].numbers(Matrix::MaxColsAtCompileTime);
      rows[i].expect(row.size() == columns, fmt::format("{} numbers in each row", columns));
      for (std::size_t j = 0; j < columns; ++j) out(i, j) = row[j];
    }
  }
  void expect(bool ok, const std::string& accepted) const {
    if (ok) return;
    std::string found = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (found.size() > 60) found = found.substr(0, 57) + "...";
    throw Error(ErrorParts{.where = where_, .key = path_, .found = found, .accepted = accepted});
  }

 private:
  const Json& json_;
  std::string where_;
  std::string path_;
};

AbsorbedFraction read_absorbed(const Reader& json) {
  return {json["fixed_front"].number(), json["scaled_front"].number(), json["fixed_back"].number(),
          json["scaled_back"].number()};
}

Tissue read_tissue(const Reader& json) {
  Tissue tissue;
  tissue.ambient_celsius = json["ambient_C"].number();
  tissue.domain_radius = json["domain_radius_m"].number();
  tissue.spot_radius = json["spot_radius_m"].number();
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
  for (const Reader& layer : json["layers"].list(32)) {
    tissue.layers.push_back({layer["name"].text(), layer["thickness_m"].number(),
                             layer["absorption_per_m"].number(),
                             layer["scaled_by_alpha"].boolean()});
  }
  return tissue;
}

Discretization read_discretization(const Reader& json) {
  const std::string text = json.text();
  for (const auto how : {Discretization::kZeroOrderHold, Discretization::kImplicitEuler}) {
    if (text == to_string(how)) return how;
  }
  json.expect(false, "\"zero-order-hold\" or \"implicit-euler\"");
  return Discretization::kZeroOrderHold;
}

Theta read_theta(const Reader& json) {
  Theta theta;
  const std::string kind = json["kind"].text();
  json["kind"].expect(kind == "deim" || kind == "chebyshev" || kind == "taylor",
                      "\"deim\", \"chebyshev\" or \"taylor\"");
  if (kind == "deim") {
    for (const Reader& point : json["points"].list(kMaxTerms)) {
      theta.points[theta.terms++] = read_absorbed(point);
    }
    return theta;
  }
  const std::size_t terms = json["terms"].count();
  json["terms"].expect(terms >= 1 && terms <= kMaxTerms, fmt::format("1 to {}", kMaxTerms));
  theta.terms = static_cast<int>(terms);
  theta.kind = kind == "taylor" ? ThetaKind::kTaylor : ThetaKind::kChebyshev;
  theta.center = json["center"].number();
  if (theta.kind == ThetaKind::kChebyshev) {
    theta.half_width = json["half_width"].number();
    json["half_width"].expect(theta.half_width > 0.0, "above 0");
  }
  return theta;
}

OutputCertificate read_output_certificate(const Reader& json) {
  OutputCertificate output;
  output.bound = json["bound_K_per_W"].numbers(kMaxNodes);
  output.relative = json["bound_relative"].numbers(kMaxNodes);
  output.treatment_bound = json["treatment_bound_K_per_W"].numbers(kMaxNodes);
  output.treatment_relative = json["treatment_bound_relative"].numbers(kMaxNodes);
  output.sum = json["sum_K_per_W"].numbers(kMaxNodes);
  output.scale = json["scale_K_per_W"].numbers(kMaxNodes);
  output.majorant = json["majorant"].numbers(kMaxMajorantTerms);
  return output;
}

ErrorCertificate read_certificate(const Reader& json) {
  ErrorCertificate certificate;
  certificate.absorption_factors = json["absorption_factors"].numbers(kMaxNodes);
  certificate.decay = json["decay_per_period"].numbers(kMaxMajorantTerms);
  certificate.treatment_duration = json["treatment_duration_s"].number();
  certificate.horizon = json["horizon_periods"].count();
  certificate.tail_relative = json["tail_relative"].number();
  certificate.peak = read_output_certificate(json["peak"]);
  certificate.volume = read_output_certificate(json["volume"]);
  certificate.validate();
  return certificate;
}

ReducedModel read_model(const Reader& json) {
  ReducedModel model;
  model.method = json["method"].text();
  const std::vector<Reader> parameters = json["parameters"].list(1);
  json["parameters"].expect(parameters.size() == 1, "one parameter, \"alpha\"");
  const Reader& range = parameters[0];
  range["name"].expect(range["name"].text() == "alpha", "\"alpha\"");
  model.absorption_min = range["min"].number();
  model.absorption_max = range["max"].number();
  range["max"].expect(model.absorption_min > 0.0 && model.absorption_max > model.absorption_min &&
                          model.absorption_max <= 10.0,
                      "0 < min < max <= 10");
  model.theta = read_theta(json["theta"]);
  // Files made before there was a choice do not name it.
  model.parameter_dependence = json.has("parameter_dependence")
                                   ? json["parameter_dependence"].text()
                                   : std::string(to_string(model.theta.kind));
  model.volume_normalized = json["volume_normalized"].boolean();
  model.whole = read_absorbed(json["absorbed_fraction"]);
  const Reader continuous = json["continuous"];
  continuous["A"].matrix(model.A);
  continuous["B"].matrix(model.B);
  continuous["C_volume"].matrix(model.C_volume);
  StateMatrix peak;
  continuous["C_peak"].matrix(peak);
  continuous["C_peak"].expect(peak.rows() == 1, "one row");
  model.C_peak = peak.row(0).transpose();
  const Reader discrete = json["discrete"];
  model.period = discrete["period_s"].number();
  model.discretization = read_discretization(discrete["discretization"]);
  discrete["A"].matrix(model.A_d);
  discrete["B"].matrix(model.B_d);
  model.tissue = read_tissue(json["tissue"]);
  model.full_order_states = json["full_order_states"].count();
  const Reader error = json["error"];
  model.error.absorption_factors = error["absorption_factors"].numbers(1000);
  model.error.peak = error["peak_relative"].numbers(1000);
  model.error.volume = error["volume_relative"].numbers(1000);
  model.error.duration = error["duration_s"].number();
  model.error.seed = error["seed"].count();
  if (json.has("certificate")) model.certificate = read_certificate(json["certificate"]);
  return model;
}

std::string checksum(Json json) {
  json.erase("checksum");
  return sha256_hex(json.dump());
}

}  // namespace

std::string to_json(const ReducedModel& model) {
  Json json = {
      {"format", "photocoag reduced model"},
      {"version", kModelFileVersion},
      {"notice", kResearchNotice},
      {"program", {{"version", version()}, {"source_hash", source_hash()}}},
      {"method", model.method},
      {"order", model.order()},
      {"parameters",
       Json::array(
           {{{"name", "alpha"}, {"min", model.absorption_min}, {"max", model.absorption_max}}})},
      {"parameter_dependence", model.parameter_dependence},
      {"theta", theta_to_json(model.theta)},
      {"volume_normalized", model.volume_normalized},
      {"absorbed_fraction", absorbed_to_json(model.whole)},
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
        {"seed", model.error.seed},
        {"peak_relative_max", model.error.peak_max()},
        {"volume_relative_max", model.error.volume_max()},
        {"absorption_factors", model.error.absorption_factors},
        {"peak_relative", model.error.peak},
        {"volume_relative", model.error.volume}}},
  };
  if (model.certificate) json["certificate"] = certificate_to_json(*model.certificate);
  json["checksum"] = checksum(json);
  return json.dump(1) + "\n";
}

ReducedModel from_json(std::string_view text, std::string_view where) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::exception& error) {
    throw Error(
        ErrorParts{.where = std::string(where),
                   .problem = fmt::format("not a complete model file (JSON): {}", error.what())});
  }
  const Reader reader(json, where);
  reader["format"].expect(reader["format"].text() == "photocoag reduced model",
                          "\"photocoag reduced model\"");
  reader["version"].expect(
      reader["version"].count() == kModelFileVersion,
      fmt::format("version {}: make the model again with `photocoag reduce`", kModelFileVersion));
  if (reader["checksum"].text() != checksum(json)) {
    throw Error(ErrorParts{.where = std::string(where),
                           .key = "checksum",
                           .problem = "the model file was altered after it was made",
                           .found = reader["checksum"].text().substr(0, 80),
                           .accepted =
                               "the SHA-256 of the file's content: make the model again with "
                               "`photocoag reduce`"});
  }
  try {
    ReducedModel model = read_model(reader);
    model.tissue.validate();
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
