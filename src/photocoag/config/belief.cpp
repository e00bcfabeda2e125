#include "photocoag/config/belief.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr std::string_view kAlphaKey = "plant.absorption_factor";
constexpr std::string_view kNoiseKey = "plant.noise_K";
constexpr std::string_view kLayers = "plant.tissue.layers.";

double normal_probability(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

// x with normal_probability(x) = p.
double normal_score(double p) {
  double low = -9.0;
  double high = 9.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (normal_probability(middle) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

// Of ln q, by the midpoint rule over the distribution function between the bounds.
Moments log_moments(const RandomQuantity& quantity) {
  constexpr int kPoints = 2000;
  const auto score = [&](double value) {
    return quantity.distribution == Distribution::kNormal
               ? (value - quantity.center) / quantity.spread
               : std::log(value / quantity.center) / quantity.spread;
  };
  const bool uniform = quantity.distribution == Distribution::kUniform;
  const double first = uniform ? 0.0 : normal_probability(score(quantity.low));
  const double last = uniform ? 1.0 : normal_probability(score(quantity.high));
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const double p = first + (last - first) * (i + 0.5) / kPoints;
    double value = quantity.low + (quantity.high - quantity.low) * p;
    if (quantity.distribution == Distribution::kNormal) {
      value = quantity.center + quantity.spread * normal_score(p);
    } else if (quantity.distribution == Distribution::kLogNormal) {
      value = quantity.center * std::exp(quantity.spread * normal_score(p));
    }
    sum += std::log(value);
    squares += std::log(value) * std::log(value);
  }
  const double mean = sum / kPoints;
  return {mean, squares / kPoints - mean * mean};
}

// What the key names, and SI = written * scale.
struct Carried {
  UncertainQuantity quantity;
  double scale = 1.0;
};

Carried carried(const RandomQuantity& random) {
  const std::string& key = random.key;
  Carried result;
  UncertainQuantity& q = result.quantity;
  const auto layer_key = [&](std::string_view end) {
    if (!key.starts_with(kLayers) || !key.ends_with(end)) return false;
    if (key.size() <= kLayers.size() + end.size()) return false;
    q.layer = key.substr(kLayers.size(), key.size() - kLayers.size() - end.size());
    return true;
  };
  if (key == kAlphaKey) {
    q.kind = QuantityKind::kAbsorptionFactor;
  } else if (key == kCalibrationFactor) {
    q.kind = QuantityKind::kCalibration;
  } else if (key == "plant.tissue.spot_radius_um") {
    q.kind = QuantityKind::kSpotRadius;
    result.scale = 1e-6;
  } else if (key == "plant.tissue.conductivity_W_per_mK") {
    q.kind = QuantityKind::kConductivity;
  } else if (key == "plant.tissue.transmission") {
    q.kind = QuantityKind::kTransmission;
  } else if (layer_key(".thickness_um")) {
    q.kind = QuantityKind::kLayerThickness;
    result.scale = 1e-6;
  } else if (layer_key(".absorption_per_m")) {
    q.kind = QuantityKind::kLayerAbsorption;
  } else {
    throw Error(ErrorParts{.key = "prior.key",
                           .problem = "no model carries this quantity",
                           .found = key,
                           .accepted = "plant.absorption_factor, plant.noise_K, "
                                       "plant.tissue.spot_radius_um, .conductivity_W_per_mK, "
                                       ".transmission, .layers.NAME.thickness_um, "
                                       ".layers.NAME.absorption_per_m, calibration_factor"});
  }
  q.low = random.low * result.scale;
  q.high = random.high * result.scale;
  q.estimated = !random.considered;
  return result;
}

}  // namespace

Belief belief_of(const Prior& prior, const EstimatorSettings& estimator) {
  Belief belief;
  if (!prior.declared()) return belief;
  std::vector<RandomQuantity> listed;
  if (prior.find(kAlphaKey) == nullptr) {
    listed.push_back({.key = std::string(kAlphaKey),
                      .distribution = Distribution::kNormal,
                      .center = estimator.absorption_initial,
                      .spread = estimator.absorption_sigma_initial,
                      .low = estimator.absorption_min,
                      .high = estimator.absorption_max});
  } else {
    listed.push_back(*prior.find(kAlphaKey));
  }
  for (const RandomQuantity& quantity : prior.quantities) {
    if (quantity.key == kNoiseKey) {
      const Moments noise = log_moments(quantity);
      belief.noise = std::exp(noise.mean);
      belief.noise_spread = std::sqrt(noise.variance);
    } else if (quantity.key != kAlphaKey) {
      listed.push_back(quantity);
    }
  }
  const std::size_t n = listed.size();
  std::vector<double> deviation;
  for (const RandomQuantity& quantity : listed) {
    const Carried c = carried(quantity);
    const Moments moments = log_moments(quantity);
    belief.quantities.push_back(c.quantity);
    belief.mean.push_back(moments.mean + std::log(c.scale));
    deviation.push_back(std::sqrt(moments.variance));
  }
  belief.covariance.assign(n * n, 0.0);
  const auto index_of = [&](const std::string& key) {
    std::size_t i = 0;
    while (i < n && listed[i].key != key) ++i;
    return i;
  };
  for (std::size_t i = 0; i < n; ++i) belief.covariance[i * n + i] = deviation[i] * deviation[i];
  for (const Correlation& correlation : prior.correlations) {
    const std::size_t i = index_of(correlation.first);
    const std::size_t j = index_of(correlation.second);
    if (i >= n || j >= n) continue;  // with the noise: it is known by its residuals
    belief.covariance[i * n + j] = belief.covariance[j * n + i] =
        correlation.value * deviation[i] * deviation[j];
  }
  return belief;
}

}  // namespace photocoag
