#include "photocoag/rom/file_parts.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kMaxNodes = 10'000;

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

OutputCertificate read_output_certificate(const JsonReader& json) {
  OutputCertificate output;
  output.bound = json["bound_K_per_W"].numbers(kMaxNodes);
  output.relative = json["bound_relative"].numbers(kMaxNodes);
  output.treatment_bound = json["treatment_bound_K_per_W"].numbers(kMaxNodes);
  output.treatment_relative = json["treatment_bound_relative"].numbers(kMaxNodes);
  output.sum = json["sum_K_per_W"].numbers(kMaxNodes);
  output.scale = json["scale_K_per_W"].numbers(kMaxNodes);
  output.majorant = json["majorant"].numbers(kMaxMajorantTerms);
  json["bound_relative_max"].expect(json["bound_relative_max"].number() == output.relative_max(),
                                    "the largest of bound_relative");
  json["treatment_bound_relative_max"].expect(
      json["treatment_bound_relative_max"].number() == output.treatment_relative_max(),
      "the largest of treatment_bound_relative");
  return output;
}

}  // namespace

namespace {

// What the file calls a parameter's optical depths and polynomials; those of alpha have no prefix.
constexpr std::array<std::string_view, kMaxParameters> kDepth = {"scaled", "choroid"};
constexpr std::array<std::string_view, kMaxParameters> kPolynomial = {"", "choroid_"};

std::string key_of(std::string_view prefix, std::string_view name) {
  return std::string(prefix) + std::string(name);
}

}  // namespace

Json matrix_to_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(std::move(row));
  }
  return rows;
}

Json absorbed_to_json(const AbsorbedFraction& a, std::size_t parameters) {
  Json json = {{"fixed_front", a.fixed_front},
               {"scaled_front", a.front[0]},
               {"fixed_back", a.fixed_back},
               {"scaled_back", a.back[0]}};
  for (std::size_t q = 1; q < parameters; ++q) {
    json[key_of(kDepth[q], "_front")] = a.front[q];
    json[key_of(kDepth[q], "_back")] = a.back[q];
  }
  return json;
}

AbsorbedFraction read_absorbed(const JsonReader& json, std::size_t parameters) {
  AbsorbedFraction a{json["fixed_front"].number(), json["fixed_back"].number(), {}, {}};
  for (std::size_t q = 0; q < parameters; ++q) {
    a.front[q] = json[key_of(kDepth[q], "_front")].number();
    a.back[q] = json[key_of(kDepth[q], "_back")].number();
  }
  return a;
}

Json theta_to_json(const Theta& theta, std::size_t parameters) {
  if (theta.kind == ThetaKind::kDeim) {
    Json points = Json::array();
    for (int j = 0; j < theta.terms; ++j) {
      points.push_back(absorbed_to_json(theta.points[j], parameters));
    }
    return {{"kind", to_string(theta.kind)}, {"points", points}};
  }
  Json json = {{"kind", to_string(theta.kind)}, {"terms", theta.terms}};
  for (std::size_t q = 0; q < parameters; ++q) {
    const auto key = [q](std::string_view name) { return key_of(kPolynomial[q], name); };
    if (q > 0) json[key("terms")] = theta.factors[q].terms;
    json[key("center")] = theta.factors[q].center;
    if (theta.kind == ThetaKind::kChebyshev) json[key("half_width")] = theta.factors[q].half_width;
  }
  return json;
}

Theta read_theta(const JsonReader& json, std::size_t parameters) {
  Theta theta;
  const std::string kind = json["kind"].text();
  json["kind"].expect(
      kind == "deim" || kind == "chebyshev" || (kind == "taylor" && parameters == 1),
      parameters == 1 ? "\"deim\", \"chebyshev\" or \"taylor\""
                      : "\"deim\" or \"chebyshev\", for two parameters");
  if (kind == "deim") {
    for (const JsonReader& point : json["points"].list(kMaxTerms)) {
      theta.points[theta.terms++] = read_absorbed(point, parameters);
    }
    return theta;
  }
  const std::size_t terms = json["terms"].count();
  json["terms"].expect(terms >= 1 && terms <= kMaxTerms, fmt::format("1 to {}", kMaxTerms));
  theta.terms = static_cast<int>(terms);
  theta.kind = kind == "taylor" ? ThetaKind::kTaylor : ThetaKind::kChebyshev;
  for (std::size_t q = 0; q < parameters; ++q) {
    const auto in_file = [&json, q](std::string_view name) {
      return json[key_of(kPolynomial[q], name)];
    };
    ThetaFactor& factor = theta.factors[q];
    if (q > 0) {
      const std::size_t own = in_file("terms").count();
      in_file("terms").expect(own >= 1 && own <= terms && terms % own == 0,
                              fmt::format("a divisor of the {} theta.terms", terms));
      factor.terms = static_cast<int>(own);
    }
    factor.center = in_file("center").number();
    if (theta.kind != ThetaKind::kChebyshev) continue;
    factor.half_width = in_file("half_width").number();
    in_file("half_width").expect(factor.half_width > 0.0, "above 0");
  }
  return theta;
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

ErrorCertificate read_certificate(const JsonReader& json) {
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

}  // namespace photocoag
