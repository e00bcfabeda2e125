#include "photocoag/tissue/absorption.hpp"

#include <algorithm>

namespace photocoag {
namespace {

double interpolate(const std::vector<double>& x, const std::vector<double>& y, double at) {
  const auto upper = std::upper_bound(x.begin() + 1, x.end() - 1, at);
  const auto i = static_cast<std::size_t>(upper - x.begin());
  const double fraction = std::clamp((at - x[i - 1]) / (x[i] - x[i - 1]), 0.0, 1.0);
  return y[i - 1] + fraction * (y[i] - y[i - 1]);
}

}  // namespace

AbsorptionLaw::AbsorptionLaw(const Tissue& tissue)
    : depths_{0.0}, fixed_{0.0}, scaled_{0.0}, choroid_{0.0} {
  tissue.validate();
  for (const Layer& layer : tissue.layers) {
    const double optical_depth = layer.absorption * layer.thickness;
    depths_.push_back(depths_.back() + layer.thickness);
    const bool fixed = !layer.scaled_by_alpha && !layer.scaled_by_beta;
    fixed_.push_back(fixed_.back() + (fixed ? optical_depth : 0.0));
    choroid_.push_back(choroid_.back() + (layer.scaled_by_beta ? optical_depth : 0.0));
    scaled_.push_back(scaled_.back() + (layer.scaled_by_alpha ? optical_depth : 0.0));
  }
}

AbsorbedFraction AbsorptionLaw::between(double front, double back) const {
  return {interpolate(depths_, fixed_, front),   interpolate(depths_, scaled_, front),
          interpolate(depths_, fixed_, back),    interpolate(depths_, scaled_, back),
          interpolate(depths_, choroid_, front), interpolate(depths_, choroid_, back)};
}

}  // namespace photocoag
