#include "photocoag/crosscheck/radial.hpp"

#include <math.h>  // j0, j1: POSIX

#include <algorithm>
#include <cmath>
#include <numbers>

namespace photocoag::crosscheck {
namespace {

constexpr double kPi = std::numbers::pi;

// Zero number m >= 1 of J0: McMahon's expansion, then Newton's method.
double bessel_zero(std::size_t m) {
  const double b = (static_cast<double>(m) - 0.25) * kPi;
  double zero = b + 1.0 / (8.0 * b) - 124.0 / (3.0 * std::pow(8.0 * b, 3));
  for (int i = 0; i < 3; ++i) zero += ::j0(zero) / ::j1(zero);
  return zero;
}

// The irradiance, not normalised: linear pieces between radii, or a Gaussian.
struct Irradiance {
  std::vector<double> radii;  // pieces, from 0 on
  std::vector<double> values;
  double width = 0.0;     // of a Gaussian, else 0
  double finest = 0.0;    // m, smallest feature
  bool has_edge = false;  // falls to 0 in a step

  double at(std::size_t piece, double r) const {
    if (width > 0.0) return std::exp(-2.0 * (r / width) * (r / width));
    const double share = (r - radii[piece]) / (radii[piece + 1] - radii[piece]);
    return values[piece] + share * (values[piece + 1] - values[piece]);
  }
};

Irradiance irradiance_of(const Tissue& tissue) {
  Irradiance beam;
  if (tissue.beam == BeamProfile::kGaussian) {
    beam.radii = {0.0, std::min(tissue.domain_radius, 3.0 * tissue.spot_radius)};
    beam.width = beam.finest = tissue.spot_radius;
    return beam;
  }
  beam.radii = tissue.beam_radii;
  beam.values = tissue.beam_intensities;
  if (beam.radii.front() > 0.0) {
    beam.radii.insert(beam.radii.begin(), 0.0);
    beam.values.insert(beam.values.begin(), beam.values.front());
  }
  beam.finest = beam.radii.back();
  for (std::size_t i = 0; i + 1 < beam.radii.size(); ++i) {
    beam.finest = std::min(beam.finest, 2.0 * (beam.radii[i + 1] - beam.radii[i]));
  }
  beam.has_edge = beam.values.back() > 0.0;
  return beam;
}

// Points r with weights g(r) 2 pi r dr, normalised: Gauss's rule with four points in panels that
// are short beside the shortest wave.
struct Quadrature {
  std::vector<double> radius;
  std::vector<double> weight;
};

Quadrature quadrature_of(const Irradiance& beam, double largest_wave_number) {
  constexpr double kNode[] = {-0.861136311594052575, -0.339981043584856265, 0.339981043584856265,
                              0.861136311594052575};
  constexpr double kWeight[] = {0.347854845137453857, 0.652145154862546143, 0.652145154862546143,
                                0.347854845137453857};
  Quadrature points;
  double total = 0.0;
  for (std::size_t piece = 0; piece + 1 < beam.radii.size(); ++piece) {
    const double from = beam.radii[piece];
    const double length = beam.radii[piece + 1] - from;
    const int panels = 4 + static_cast<int>(0.5 * length * largest_wave_number);
    for (int panel = 0; panel < panels; ++panel) {
      for (int i = 0; i < 4; ++i) {
        const double r = from + length * (panel + 0.5 * (1.0 + kNode[i])) / panels;
        points.radius.push_back(r);
        points.weight.push_back(kWeight[i] * beam.at(piece, r) * r * length / panels);
        total += points.weight.back();
      }
    }
  }
  for (double& weight : points.weight) weight /= total;
  return points;
}

}  // namespace

RadialTerms radial_terms(const Tissue& tissue) {
  const double R = tissue.domain_radius;
  const bool flat = tissue.beam == BeamProfile::kFlatTop;
  const Irradiance beam = flat ? Irradiance{} : irradiance_of(tissue);
  // A step of the irradiance needs some hundred waves across the spot, a Gaussian a handful.
  const double finest = flat ? tissue.spot_radius : beam.finest;
  const double per_feature = flat ? 200.0 : beam.width > 0.0 ? 6.0 : beam.has_edge ? 60.0 : 20.0;
  const double most = flat ? 2e5 : 1500.0;
  const auto count = static_cast<std::size_t>(std::clamp(per_feature * R / finest, 40.0, most));
  const double largest = bessel_zero(count) / R;
  const Quadrature points = flat ? Quadrature{} : quadrature_of(beam, largest);
  RadialTerms terms;
  for (std::size_t m = 1; m <= count; ++m) {
    const double zero = bessel_zero(m);
    const double k = zero / R;
    double b = 0.0;
    if (flat) {
      const double x = k * tissue.spot_radius;
      b = 2.0 * ::j1(x) / x;
    } else {
      for (std::size_t i = 0; i < points.radius.size(); ++i) {
        b += points.weight[i] * ::j0(k * points.radius[i]);
      }
    }
    const double norm = kPi * R * R * ::j1(zero) * ::j1(zero);
    // The sum on the axis of a beam with an edge converges slowly: it is tapered by a filter that
    // leaves long waves unchanged.
    const bool edge = flat || beam.has_edge;
    const double kept = edge ? std::exp(-20.0 * std::pow(k / largest, 8)) : 1.0;
    terms.rate.push_back(k * k);
    terms.peak.push_back(b / norm * kept);
    terms.volume.push_back(b * b / norm);
  }
  return terms;
}

RadialTerms on_nodes(const RadialTerms& terms, const std::vector<double>& nodes) {
  const std::size_t count = nodes.size();
  RadialTerms sums{nodes, std::vector<double>(count), std::vector<double>(count)};
  const double low = std::log(nodes.front());
  const double spacing = (std::log(nodes.back()) - low) / static_cast<double>(count - 1);
  for (std::size_t m = 0; m < terms.rate.size(); ++m) {
    const double x = (std::log(terms.rate[m]) - low) / spacing;
    const auto first = static_cast<std::size_t>(
        std::clamp(std::floor(x) - 1.0, 0.0, static_cast<double>(count) - 4.0));
    const double t = x - static_cast<double>(first);  // from 0 to 3 over the four
    const double shares[] = {-(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0,
                             t * (t - 2.0) * (t - 3.0) / 2.0, -t * (t - 1.0) * (t - 3.0) / 2.0,
                             t * (t - 1.0) * (t - 2.0) / 6.0};
    for (std::size_t i = 0; i < 4; ++i) {
      sums.peak[first + i] += shares[i] * terms.peak[m];
      sums.volume[first + i] += shares[i] * terms.volume[m];
    }
  }
  return sums;
}

}  // namespace photocoag::crosscheck
