// Role: setup; the prior of an eye: uncertain quantities, their ranges and a Gaussian in their
// logarithms. Used by mor (ranges), estimation (prior), config, campaign. Source:
// docs/uncertainty.md.
// Units: SI; every quantity is positive.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/core/types.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// What differs from eye to eye, in the order in which a model lists them.
enum class QuantityKind {
  kAbsorptionFactor,  ///< alpha
  kLayerThickness,    ///< m
  kLayerAbsorption,   ///< 1/m
  kSpotRadius,        ///< m
  kConductivity,      ///< W/(m K), of all layers
  kTransmission,      ///< 1, of the optics in front of the fundus
  kCalibration,       ///< 1, measured volume temperature / true one
};

std::string_view to_string(QuantityKind kind) noexcept;

inline constexpr int kMaxQuantities = 10;

struct UncertainQuantity {
  QuantityKind kind = QuantityKind::kAbsorptionFactor;
  std::string layer;  ///< for the two kinds that have one, else empty
  double low = 0.0;   ///< SI, above 0
  double high = 0.0;
  /// False: its covariance counts, but its value stays at the prior mean (a consider parameter).
  bool estimated = true;

  /// Transmission and calibration scale the outputs exactly and are not part of the fit.
  bool is_factor() const noexcept {
    return kind == QuantityKind::kTransmission || kind == QuantityKind::kCalibration;
  }
  bool operator==(const UncertainQuantity&) const = default;
};

/// ln q ~ N(mean, covariance), and the noise of the sample: ln sigma_y ~ N(ln noise,
/// noise_spread^2).
struct Belief {
  std::vector<UncertainQuantity> quantities;
  std::vector<double> mean;        ///< of ln q, SI
  std::vector<double> covariance;  ///< of ln q, row by row
  double noise = 0.0;              ///< K; 0: the estimator's measurement_noise
  double noise_spread = 0.0;       ///< of its logarithm

  bool declared() const noexcept { return !quantities.empty(); }
  Eigen::MatrixXd covariance_matrix() const;
  /// Throws Error: sizes, ranges, the first quantity must be alpha, covariance positive definite.
  void validate() const;
  bool operator==(const Belief&) const = default;
};

/// `tissue` with the quantity at `value`; alpha, transmission and calibration leave it as it is.
/// Throws Error if it has no such layer.
Tissue with_quantity(Tissue tissue, const UncertainQuantity& quantity, double value);

}  // namespace photocoag
