// Role: tests; a belief of seven quantities and its model from a coarse grid, made once.
#pragma once

#include <cmath>
#include <memory>

#include "photocoag/estimation/settings.hpp"
#include "photocoag/mor/uncertain_fit.hpp"
#include "photocoag/rom/uncertain_model.hpp"

namespace photocoag::testing {

inline Belief seven_quantities() {
  Belief belief;
  const auto add = [&](QuantityKind kind, const char* layer, double low, double high, double mean,
                       double deviation) {
    belief.quantities.push_back({kind, layer, low, high, true});
    belief.mean.push_back(std::log(mean));
    belief.covariance.push_back(deviation * deviation);
  };
  add(QuantityKind::kAbsorptionFactor, "", 0.35, 1.5, 0.7363, 0.3);
  add(QuantityKind::kLayerThickness, "RPE", 4.5e-6, 7.5e-6, 6e-6, 0.08);
  add(QuantityKind::kLayerAbsorption, "choroid", 1000.0, 8000.0, 2662.2, 0.3);
  add(QuantityKind::kSpotRadius, "", 88e-6, 112e-6, 100e-6, 0.04);
  add(QuantityKind::kTransmission, "", 0.85, 1.0, 0.925, 0.047);
  add(QuantityKind::kConductivity, "", 0.56, 0.69, 0.627, 0.032);
  add(QuantityKind::kCalibration, "", 0.9, 1.1, 1.0, 0.03);
  const std::vector<double> variances = belief.covariance;
  const std::size_t n = variances.size();
  belief.covariance.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) belief.covariance[i * n + i] = variances[i];
  return belief;
}

inline GridSettings coarse_grid() { return {.min_cells = 4000}; }

/// For 1 ms.
inline const std::shared_ptr<const UncertainModel>& seven_quantity_model() {
  static const auto model = std::make_shared<const UncertainModel>(
      fit_uncertain_model(Tissue(), coarse_grid(), seven_quantities(), 1e-3));
  return model;
}

/// Its modes for the control problem, and the responses over the quantities.
inline ReducedModel model_of_seven() {
  ReducedModel model = seven_quantity_model()->control_model();
  model.uncertain = seven_quantity_model();
  return model;
}

/// Believes in the seven, with a known noise.
inline EstimatorSettings believing() {
  EstimatorSettings settings;
  settings.kind = EstimatorKind::kPosterior;
  settings.prior = seven_quantities();
  settings.prior.noise = 0.288;
  return settings;
}

/// ln q of an eye inside the box: each quantity at `share` of its range, in the logarithm.
inline QuantityVector logs_at(const std::vector<double>& shares) {
  const Belief belief = seven_quantities();
  QuantityVector logs(static_cast<Eigen::Index>(shares.size()));
  for (std::size_t q = 0; q < shares.size(); ++q) {
    const double low = std::log(belief.quantities[q].low);
    const double high = std::log(belief.quantities[q].high);
    logs[static_cast<Eigen::Index>(q)] = low + shares[q] * (high - low);
  }
  return logs;
}

}  // namespace photocoag::testing
