#include "photocoag/tissue/beam.hpp"

#include <algorithm>
#include <cmath>

namespace photocoag {
namespace {

// int_a^b I(r) r dr for I linear from (r0, i0) to (r1, i1); a, b inside [r0, r1].
double linear_share(double r0, double i0, double r1, double i1, double a, double b) {
  const double slope = (i1 - i0) / (r1 - r0);
  const double middle = i0 + slope * (0.5 * (a + b) - r0);
  // Simpson's rule is exact for the quadratic I(r) r.
  const double at_a = (i0 + slope * (a - r0)) * a;
  const double at_b = (i0 + slope * (b - r0)) * b;
  return (b - a) / 6.0 * (at_a + 4.0 * middle * 0.5 * (a + b) + at_b);
}

}  // namespace

Beam::Beam(const Tissue& tissue)
    : profile_(tissue.beam),
      spot_radius_(tissue.spot_radius),
      domain_radius_(tissue.domain_radius),
      radii_(tissue.beam_radii),
      intensities_(tissue.beam_intensities) {
  tissue.validate();
  if (profile_ != BeamProfile::kTable) return;
  if (radii_.front() > 0.0) {
    radii_.insert(radii_.begin(), 0.0);
    intensities_.insert(intensities_.begin(), intensities_.front());
  }
  const double total = share(0.0, domain_radius_);
  for (double& intensity : intensities_) intensity /= total;
}

double Beam::share(double inner, double outer) const {
  const auto squared = [this](double r) { return (r / spot_radius_) * (r / spot_radius_); };
  switch (profile_) {
    case BeamProfile::kFlatTop: {
      const double a = std::min(inner, spot_radius_);
      const double b = std::min(outer, spot_radius_);
      return (b - a) * (b + a) / (spot_radius_ * spot_radius_);
    }
    case BeamProfile::kGaussian: {
      // exp(-2 a^2/w^2) - exp(-2 b^2/w^2) without cancellation in thin rings.
      const double width = 2.0 * (outer - inner) * (outer + inner) / (spot_radius_ * spot_radius_);
      return -std::exp(-2.0 * squared(inner)) * std::expm1(-width) /
             -std::expm1(-2.0 * squared(domain_radius_));
    }
    case BeamProfile::kTable: {
      double sum = 0.0;
      for (std::size_t i = 0; i + 1 < radii_.size(); ++i) {
        const double a = std::max(inner, radii_[i]);
        const double b = std::min(outer, radii_[i + 1]);
        if (a >= b) continue;
        sum += linear_share(radii_[i], intensities_[i], radii_[i + 1], intensities_[i + 1], a, b);
      }
      return sum;
    }
  }
  return 0.0;
}

}  // namespace photocoag
