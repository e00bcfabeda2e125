#include "photocoag/config/random_quantities.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>
#include <variant>
#include <vector>

#include "photocoag/config/fields.hpp"
#include "photocoag/config/table_reader.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {
namespace {

void read_distribution(const TableReader& table, bool of_controller, RandomQuantity& quantity) {
  const std::string word = table.required_text("distribution");
  quantity.low = table.required_number("low");
  quantity.high = table.required_number("high");
  if (of_controller) {
    table.require(quantity.low < quantity.high, "high",
                  fmt::format("above low = {}", quantity.low));
  } else {
    table.require(quantity.low <= quantity.high, "high",
                  fmt::format("at least low = {}", quantity.low));
  }
  const bool normal = word == "normal";
  if (!normal && word != "log-normal") {
    table.require(word == "uniform", "distribution", "\"normal\" or \"log-normal\" or \"uniform\"");
    return;
  }
  const std::string_view center = normal ? "mean" : "median";
  const std::string_view spread = normal ? "sigma" : "sigma_log";
  quantity.distribution = normal ? Distribution::kNormal : Distribution::kLogNormal;
  quantity.center = table.required_number(center);
  quantity.spread = table.required_number(spread);
  table.require(normal || quantity.center > 0.0, center, "a number above 0");
  table.require(of_controller ? quantity.spread > 0.0 : quantity.spread >= 0.0, spread,
                of_controller ? "a number above 0" : "a number from 0 on");
  table.require(quantity.low <= quantity.center && quantity.center <= quantity.high, center,
                fmt::format("from low = {} to high = {}", quantity.low, quantity.high));
}

// A parameter of another distribution is an error.
void refuse_foreign(const TableReader& table, Distribution distribution) {
  const auto foreign = [&](std::string_view key, Distribution owner) {
    if (distribution == owner || table.find(key) == nullptr) return;
    table.require(false, key,
                  distribution == Distribution::kNormal      ? "a normal one has mean and sigma"
                  : distribution == Distribution::kLogNormal ? "a log-normal one has median and "
                                                               "sigma_log"
                                                             : "a uniform one has low and high");
  };
  foreign("mean", Distribution::kNormal);
  foreign("sigma", Distribution::kNormal);
  foreign("median", Distribution::kLogNormal);
  foreign("sigma_log", Distribution::kLogNormal);
}

RandomQuantity read_quantity(TableReader table, const PriorTables& tables) {
  if (tables.of_controller) {
    table.only(
        {"key", "distribution", "mean", "median", "sigma", "sigma_log", "low", "high", "use"});
  } else {
    table.only({"key", "distribution", "mean", "median", "sigma", "sigma_log", "low", "high"});
  }
  RandomQuantity quantity;
  quantity.key = table.required_text("key");
  table.rename(fmt::format("{}.{}", tables.quantities, shown(quantity.key)));
  read_distribution(table, tables.of_controller, quantity);
  if (tables.of_controller) refuse_foreign(table, quantity.distribution);
  quantity.considered = table.word("use", {"estimated", "considered"}, "estimated") == "considered";
  return quantity;
}

Correlation read_correlation(const TableReader& table, const Prior& prior,
                             const PriorTables& tables) {
  table.only({"between", "value"});
  const Value& between = table.required("between");
  std::vector<std::string> keys;
  if (between.kind == Value::Kind::kArray) {
    for (const Entry& entry : between.entries) keys.push_back(entry.value.string);
  }
  const bool two = keys.size() == 2 && keys[0] != keys[1] && prior.find(keys[0]) != nullptr &&
                   prior.find(keys[1]) != nullptr;
  table.require(two, "between", fmt::format("two keys of [[{}]]", tables.quantities));
  const Correlation correlation{keys[0], keys[1], table.required_number("value")};
  table.require(std::abs(correlation.value) < 1.0, "value", "above -1, below 1");
  return correlation;
}

struct Sums {
  double weight = 0.0;
  double first = 0.0;
  double second = 0.0;
};

// Simpson's rule over the score (uniform: the value itself): exact to rounding for what is smooth.
template <typename Of>
Moments integrate(const RandomQuantity& q, const Of& of) {
  constexpr double kFarthest = 9.0;  // deviations: beyond lies 1e-19
  constexpr int kSteps = 4000;
  const bool uniform = q.distribution == Distribution::kUniform;
  const bool normal = q.distribution == Distribution::kNormal;
  const auto score = [&](double x) {
    if (normal) return (x - q.center) / q.spread;
    return x > 0.0 ? std::log(x / q.center) / q.spread : -kFarthest;
  };
  const double from = uniform ? q.low : std::max(-kFarthest, score(q.low));
  const double to = uniform ? q.high : std::min(kFarthest, score(q.high));
  const auto value = [&](double t) {
    if (uniform) return t;
    return normal ? q.center + q.spread * t : q.center * std::exp(q.spread * t);
  };
  Sums sums;
  const double shift = of(uniform ? 0.5 * (q.low + q.high) : q.center);
  for (int i = 0; i <= kSteps; ++i) {
    const double t = from + (to - from) * i / kSteps;
    const double simpson = i == 0 || i == kSteps ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    const double weight = simpson * (uniform ? 1.0 : std::exp(-0.5 * t * t));
    const double x = of(value(t)) - shift;
    sums.weight += weight;
    sums.first += weight * x;
    sums.second += weight * x * x;
  }
  const double mean = sums.first / sums.weight;
  return {shift + mean, std::sqrt(std::max(0.0, sums.second / sums.weight - mean * mean))};
}

bool certain(const RandomQuantity& q) {
  return q.low == q.high || (q.distribution != Distribution::kUniform && q.spread == 0.0);
}

bool is_last_layer(const Tissue& tissue, std::string_view key) {
  return key == fmt::format("plant.tissue.layers.{}.thickness_um", tissue.layers.back().name);
}

// Why the several-parameter model cannot carry it; empty: it can.
std::string not_carried(const Tissue& tissue, const std::string& key) {
  constexpr std::string_view kCarried[] = {kCalibrationFactor, "plant.absorption_factor",
                                           "plant.noise_K", "plant.tissue.spot_radius_um",
                                           "plant.tissue.transmission"};
  if (std::find(std::begin(kCarried), std::end(kCarried), key) != std::end(kCarried)) return {};
  if (key == "plant.tissue.conductivity_W_per_mK") {
    return tissue.uniform_conduction() ? "" : "layers conduct or store heat differently";
  }
  for (const Layer& layer : tissue.layers) {
    const std::string prefix = fmt::format("plant.tissue.layers.{}.", layer.name);
    if (key == prefix + "absorption_per_m") return {};
    if (key != prefix + "thickness_um") continue;
    return is_last_layer(tissue, key) ? "the last layer makes up for the others" : "";
  }
  return "the controller's model does not carry it";
}

}  // namespace

Prior read_prior(const Value& root, const PriorTables& tables) {
  const TableReader file(root, "");
  Prior prior;
  for (const TableReader& table : file.tables(tables.quantities)) {
    RandomQuantity quantity = read_quantity(table, tables);
    table.require(prior.find(quantity.key) == nullptr, "key", "each key once");
    prior.quantities.push_back(std::move(quantity));
  }
  for (const TableReader& table : file.tables(tables.correlations)) {
    prior.correlations.push_back(read_correlation(table, prior, tables));
  }
  return prior;
}

Eigen::MatrixXd correlation_matrix(const Prior& prior, const PriorTables& tables) {
  const auto size = static_cast<Eigen::Index>(prior.quantities.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(size, size);
  for (const Correlation& pair : prior.correlations) {
    const RandomQuantity* const first = prior.find(pair.first);
    const RandomQuantity* const second = prior.find(pair.second);
    if (first == nullptr || second == nullptr || first == second) {
      throw Error(ErrorParts{.key = std::string(tables.correlations),
                             .found = fmt::format("{}, {}", pair.first, pair.second),
                             .accepted = fmt::format("two keys of [[{}]]", tables.quantities)});
    }
    const auto i = first - prior.quantities.data();
    const auto j = second - prior.quantities.data();
    matrix(i, j) = matrix(j, i) = pair.value;
  }
  if (size > 0 && !cholesky(matrix)) {
    std::string values;
    for (const Correlation& pair : prior.correlations) {
      values += fmt::format("{}{}", values.empty() ? "" : ", ", pair.value);
    }
    throw Error(
        ErrorParts{.key = std::string(tables.correlations),
                   .found = values,
                   .accepted = "correlations that are possible together (positive definite)"});
  }
  return matrix;
}

Moments moments(const RandomQuantity& q) {
  if (certain(q)) return {q.distribution == Distribution::kUniform ? q.low : q.center, 0.0};
  return integrate(q, [](double x) { return x; });
}

Moments log_moments(const RandomQuantity& q) {
  if (certain(q)) return {std::log(moments(q).mean), 0.0};
  return integrate(q, [](double x) { return std::log(x); });
}

std::optional<EyeNumber> eye_number(Config& config, std::string_view key) {
  if (!key.starts_with("plant.")) return std::nullopt;
  std::vector<Field> known = fields(config);
  for (Layer& layer : config.plant.tissue.layers) {
    for (Field& field : layer_fields(layer, "plant.tissue.layers." + layer.name)) {
      known.push_back(std::move(field));
    }
  }
  for (const Field& field : known) {
    const auto* number = std::get_if<NumberField>(&field.value);
    if (field.key != key || number == nullptr) continue;
    return EyeNumber{number->value, std::pow(10.0, number->unit.exponent)};
  }
  return std::nullopt;
}

void validate_prior(const Config& config) {
  const Prior& prior = config.prior;
  if (!prior.declared() && prior.correlations.empty()) return;
  for (const RandomQuantity& q : prior.quantities) {
    const std::string key = "prior." + shown(q.key);
    if (std::string why = not_carried(config.tissue, q.key); !why.empty()) {
      throw Error(ErrorParts{
          .key = key,
          .problem = std::move(why),
          .found = toml_quoted(shown(q.key)),
          .accepted = "plant.absorption_factor, plant.noise_K, plant.tissue.spot_radius_um, "
                      "plant.tissue.transmission, plant.tissue.conductivity_W_per_mK (all layers "
                      "alike), plant.tissue.layers.NAME.absorption_per_m or .thickness_um (not of "
                      "the last layer), calibration_factor"});
    }
    const bool spread = q.distribution == Distribution::kUniform ||
                        (q.spread > 0.0 && q.low <= q.center && q.center <= q.high);
    if (!(q.low < q.high) || !spread) {
      throw Error(ErrorParts{.key = key,
                             .found = fmt::format("center {}, spread {}, bounds {} and {}",
                                                  q.center, q.spread, q.low, q.high),
                             .accepted = "low below high, a spread above 0, a center in between"});
    }
    if (!(q.low > 0.0)) {  // what is believed is a logarithm
      throw Error(ErrorParts{
          .key = key + ".low", .found = fmt::format("{}", q.low), .accepted = "a number above 0"});
    }
  }
  correlation_matrix(prior, kPriorTables);
  for (const bool highest : {false, true}) {
    Config copy = config;
    copy.prior = {};
    copy.control.robust = Robustness::kNone;
    copy.estimator.kind = EstimatorKind::kEkf;
    copy.control.identification_duration = 0.0;
    for (const RandomQuantity& q : prior.quantities) {
      const std::optional<EyeNumber> number = eye_number(copy, q.key);
      if (number) *number->value = (highest ? q.high : q.low) * number->scale;
    }
    try {
      copy.validate();
    } catch (const Error& error) {
      ErrorParts parts = error.parts();
      parts.key = fmt::format("prior.{}.{}", parts.key, highest ? "high" : "low");
      throw Error(std::move(parts));
    }
  }
}

}  // namespace photocoag
