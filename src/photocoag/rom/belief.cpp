#include "photocoag/rom/belief.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/linear_algebra.hpp"

namespace photocoag {

std::string_view to_string(QuantityKind kind) noexcept {
  constexpr std::string_view names[] = {"absorption_factor", "thickness",    "absorption",
                                        "spot_radius",       "conductivity", "transmission",
                                        "calibration_factor"};
  return names[static_cast<std::size_t>(kind)];
}

Eigen::MatrixXd Belief::covariance_matrix() const {
  const auto n = static_cast<Eigen::Index>(quantities.size());
  return Eigen::Map<const Eigen::MatrixXd>(covariance.data(), n, n);
}

void Belief::validate() const {
  const std::size_t n = quantities.size();
  const auto refuse = [](std::string found, std::string accepted) {
    throw Error(
        ErrorParts{.key = "prior", .found = std::move(found), .accepted = std::move(accepted)});
  };
  if (n == 0 || n > static_cast<std::size_t>(kMaxQuantities)) {
    refuse(fmt::format("{} quantities", n), fmt::format("1 to {} quantities", kMaxQuantities));
  }
  if (mean.size() != n || covariance.size() != n * n) refuse("sizes that differ", "one size");
  if (quantities.front().kind != QuantityKind::kAbsorptionFactor) {
    refuse(std::string(to_string(quantities.front().kind)),
           "plant.absorption_factor among the quantities");
  }
  for (std::size_t i = 0; i < n; ++i) {
    const UncertainQuantity& q = quantities[i];
    const bool inside =
        q.low > 0.0 && q.low < q.high && mean[i] > std::log(q.low) && mean[i] < std::log(q.high);
    if (!inside) {
      refuse(fmt::format("{} {} from {} to {}", to_string(q.kind), q.layer, q.low, q.high),
             "a range above 0 with the mean inside");
    }
  }
  if (!cholesky(covariance_matrix())) refuse("a covariance", "a positive definite one");
}

Tissue with_quantity(Tissue tissue, const UncertainQuantity& quantity, double value) {
  const auto layer = [&]() -> Layer& {
    const auto found = std::find_if(tissue.layers.begin(), tissue.layers.end(),
                                    [&](const Layer& l) { return l.name == quantity.layer; });
    if (found == tissue.layers.end()) {
      throw Error(ErrorParts{.key = "prior.key",
                             .problem = "the tissue has no such layer",
                             .found = quantity.layer,
                             .accepted = "a layer of [tissue]"});
    }
    return *found;
  };
  switch (quantity.kind) {
    case QuantityKind::kLayerThickness:
      layer().thickness = value;
      break;
    case QuantityKind::kLayerAbsorption:
      layer().absorption = value;
      break;
    case QuantityKind::kSpotRadius:
      tissue.spot_radius = value;
      break;
    case QuantityKind::kConductivity:
      tissue.conductivity = value;
      break;
    case QuantityKind::kAbsorptionFactor:
    case QuantityKind::kTransmission:
    case QuantityKind::kCalibration:
      break;
  }
  return tissue;
}

}  // namespace photocoag
