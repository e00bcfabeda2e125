#include "photocoag/config/belief.hpp"

#include <cmath>

#include "photocoag/config/random_quantities.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr std::string_view kAlphaKey = "plant.absorption_factor";
constexpr std::string_view kNoiseKey = "plant.noise_K";
constexpr std::string_view kLayers = "plant.tissue.layers.";

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
      belief.noise_spread = noise.deviation;
    } else if (quantity.key != kAlphaKey) {
      listed.push_back(quantity);
    }
  }
  const std::size_t n = listed.size();
  std::vector<double> deviation;
  for (const RandomQuantity& quantity : listed) {
    const Carried c = carried(quantity);
    const Moments of_log = log_moments(quantity);
    belief.quantities.push_back(c.quantity);
    belief.mean.push_back(of_log.mean + std::log(c.scale));
    deviation.push_back(of_log.deviation);
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
