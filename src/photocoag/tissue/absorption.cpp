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

AbsorptionLaw::AbsorptionLaw(const Tissue& tissue) : depths_{0.0}, fixed_{0.0} {
  tissue.validate();
  scaled_.fill({0.0});
  for (const Layer& layer : tissue.layers) {
    const double optical_depth = layer.absorption * layer.thickness;
    const auto part = [&layer, optical_depth](ScaledBy by) {
      return layer.scaled_by == by ? optical_depth : 0.0;
    };
    depths_.push_back(depths_.back() + layer.thickness);
    fixed_.push_back(fixed_.back() + part(ScaledBy::kNothing));
    for (std::size_t q = 0; q < kMaxParameters; ++q) {
      scaled_[q].push_back(scaled_[q].back() + part(ScaledBy(q + 1)));
    }
  }
}

AbsorbedFraction AbsorptionLaw::between(double front, double back) const {
  AbsorbedFraction result{
      interpolate(depths_, fixed_, front), interpolate(depths_, fixed_, back), {}, {}};
  for (std::size_t q = 0; q < kMaxParameters; ++q) {
    result.front[q] = interpolate(depths_, scaled_[q], front);
    result.back[q] = interpolate(depths_, scaled_[q], back);
  }
  return result;
}

}  // namespace photocoag
