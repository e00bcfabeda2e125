#include "photocoag/rom/uncertain_file.hpp"

#include <fmt/format.h>

#include <array>

#include "photocoag/rom/file_parts.hpp"

namespace photocoag {
namespace {

constexpr std::array kKinds = {QuantityKind::kAbsorptionFactor, QuantityKind::kLayerThickness,
                               QuantityKind::kLayerAbsorption,  QuantityKind::kSpotRadius,
                               QuantityKind::kConductivity,     QuantityKind::kTransmission,
                               QuantityKind::kCalibration};

Eigen::MatrixXd read_rows(const JsonReader& json, std::size_t rows, std::size_t columns) {
  const std::vector<JsonReader> list = json.list(kMaxOrder);
  json.expect(list.size() == rows, fmt::format("{} rows, one per rate", rows));
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
  for (std::size_t i = 0; i < rows; ++i) {
    const std::vector<double> row = list[i].numbers(kMaxPolynomialTerms);
    list[i].expect(row.size() == columns, fmt::format("{} numbers, one per term", columns));
    for (std::size_t j = 0; j < columns; ++j) {
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = row[j];
    }
  }
  return matrix;
}

UncertainQuantity read_quantity(const JsonReader& json) {
  UncertainQuantity quantity;
  const std::string name = json["name"].text();
  bool known = false;
  for (const QuantityKind kind : kKinds) {
    if (name != to_string(kind)) continue;
    quantity.kind = kind;
    known = true;
  }
  json["name"].expect(known, "a quantity that this program knows");
  if (json.has("layer")) quantity.layer = json["layer"].text();
  quantity.low = json["min"].number();
  quantity.high = json["max"].number();
  quantity.estimated = json["estimated"].boolean();
  json["max"].expect(quantity.low > 0.0 && quantity.low < quantity.high, "0 < min < max");
  return quantity;
}

PolynomialTerm read_term(const JsonReader& json) {
  const std::vector<JsonReader> numbers = json.list(3);
  json.expect(numbers.size() == 3, "parent, quantity, degree");
  const auto count = [&](std::size_t i) {
    constexpr std::size_t kMost = 1000;
    numbers[i].expect(numbers[i].count() <= kMost, "a small number");
    return static_cast<int>(numbers[i].count());
  };
  return {count(0), count(1), count(2)};
}

}  // namespace

Json uncertain_to_json(const UncertainModel& model) {
  Json quantities = Json::array();
  for (const UncertainQuantity& quantity : model.quantities) {
    Json json = {{"name", to_string(quantity.kind)}};
    if (!quantity.layer.empty()) json["layer"] = quantity.layer;
    json["min"] = quantity.low;
    json["max"] = quantity.high;
    json["estimated"] = quantity.estimated;
    quantities.push_back(std::move(json));
  }
  Json terms = Json::array();
  for (const PolynomialTerm& term : model.terms) {
    terms.push_back(Json::array({term.parent, term.quantity, term.degree}));
  }
  return {
      {"quantities", std::move(quantities)},
      {"rates_per_s", model.rates},
      {"terms", std::move(terms)},
      {"peak_exponents", model.peak_exponents},
      {"volume_exponents", model.volume_exponents},
      {"peak", matrix_to_json(model.peak)},
      {"volume", matrix_to_json(model.volume)},
      {"error",
       {{"meaning", "of step responses of eyes that fill the box, relative to their last value"},
        {"peak_rms", model.peak_error_rms},
        {"peak_max", model.peak_error_max},
        {"volume_rms", model.volume_error_rms},
        {"volume_max", model.volume_error_max}}}};
}

UncertainModel read_uncertain(const JsonReader& json, const Tissue& tissue, double period) {
  UncertainModel model;
  for (const JsonReader& quantity : json["quantities"].list(kMaxQuantities)) {
    model.quantities.push_back(read_quantity(quantity));
  }
  model.rates = json["rates_per_s"].numbers(kMaxOrder);
  for (const JsonReader& term : json["terms"].list(kMaxPolynomialTerms - 1)) {
    model.terms.push_back(read_term(term));
  }
  model.peak_exponents = json["peak_exponents"].numbers(kMaxQuantities);
  model.volume_exponents = json["volume_exponents"].numbers(kMaxQuantities);
  const std::size_t columns = model.terms.size() + 1;
  model.peak = read_rows(json["peak"], model.rates.size(), columns);
  model.volume = read_rows(json["volume"], model.rates.size(), columns);
  const JsonReader error = json["error"];
  model.peak_error_rms = error["peak_rms"].number();
  model.peak_error_max = error["peak_max"].number();
  model.volume_error_rms = error["volume_rms"].number();
  model.volume_error_max = error["volume_max"].number();
  model.tissue = tissue;
  model.period = period;
  model.validate();
  return model;
}

}  // namespace photocoag
