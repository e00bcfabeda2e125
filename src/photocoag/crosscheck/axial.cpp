#include "photocoag/crosscheck/axial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/crosscheck/heating.hpp"

namespace photocoag::crosscheck {
namespace {

double coefficient(const Layer& layer, AbsorptionFactors at) {
  return layer.absorption * (layer.scaled_by == ScaledBy::kAlpha  ? at.alpha
                             : layer.scaled_by == ScaledBy::kBeta ? at.beta
                                                                  : 1.0);
}

Pencil pencil_of(const std::vector<double>& depth, const std::vector<std::size_t>& layer,
                 const std::vector<ThermalData>& thermal, double rate) {
  const std::size_t n = depth.size() - 2;
  const Symmetric empty{std::vector<double>(n), std::vector<double>(n)};
  Pencil p{empty, empty};
  for (std::size_t e = 0; e + 1 < depth.size(); ++e) {
    const double h = depth[e + 1] - depth[e];
    const ThermalData& data = thermal[layer[e]];
    const double loss = data.conductivity * rate + data.perfusion;
    const double heat = data.volumetric_heat_capacity;
    p.slowest = std::min(p.slowest, loss / heat);
    for (std::size_t node = e; node <= e + 1; ++node) {
      if (node == 0 || node > n) continue;
      p.mass.diagonal[node - 1] += heat * h / 3.0;
      p.stiffness.diagonal[node - 1] += data.conductivity / h + loss * h / 3.0;
    }
    if (e == 0 || e >= n) continue;
    p.mass.beside[e - 1] += heat * h / 6.0;
    p.stiffness.beside[e - 1] += loss * h / 6.0 - data.conductivity / h;
  }
  return p;
}

}  // namespace

DepthElements::DepthElements(const Tissue& tissue) {
  // Elements grow with the distance from the peak and from the faces of what absorbs.
  struct Fine {
    double at;
    double size;
  };
  std::vector<Fine> fine;
  double front = 0.0;
  std::vector<double> faces = {0.0};
  const double peak = tissue.peak_depth();
  for (const Layer& layer : tissue.layers) {
    thermal_.push_back(tissue.thermal(layer));
    const double back = front + layer.thickness;
    if (layer.absorption > 0.0) {
      const double most = coefficient(layer, {2.0, 2.0});
      const double size = std::min(layer.thickness / 16.0, 1.0 / (24.0 * most));
      fine.push_back({front, size});
      fine.push_back({back, size});
    }
    if (peak > front && peak < back) fine.push_back({peak, layer.thickness / 24.0});
    faces.push_back(back);
    front = back;
  }
  const auto size_at = [&fine](double z) {
    double size = std::numeric_limits<double>::infinity();
    for (const Fine& f : fine) size = std::min(size, f.size + 0.07 * std::abs(z - f.at));
    return size;
  };
  depth_.push_back(0.0);
  for (std::size_t l = 0; l < tissue.layers.size(); ++l) {
    std::vector<double> stops = {faces[l + 1]};
    if (peak > faces[l] && peak < faces[l + 1]) stops = {peak, faces[l + 1]};
    for (const double stop : stops) {
      // As many elements as the integral of 1 / size asks for, each with the same share of it.
      const double from = depth_.back();
      std::vector<double> along = {0.0};
      std::vector<double> place = {from};
      while (place.back() < stop) {
        const double step = std::min(0.25 * size_at(place.back()), stop - place.back());
        along.push_back(along.back() + step / size_at(place.back() + 0.5 * step));
        place.push_back(step < 1e-6 * size_at(stop) ? stop : place.back() + step);
      }
      const auto elements = static_cast<std::size_t>(std::max(2.0, std::ceil(along.back())));
      std::size_t i = 1;
      for (std::size_t e = 1; e < elements; ++e) {
        const double wanted = along.back() * static_cast<double>(e) / static_cast<double>(elements);
        while (along[i] < wanted) ++i;
        const double part = (wanted - along[i - 1]) / (along[i] - along[i - 1]);
        depth_.push_back(place[i - 1] + part * (place[i] - place[i - 1]));
        layer_.push_back(l);
      }
      depth_.push_back(stop);
      layer_.push_back(l);
      if (stop == peak) peak_ = depth_.size() - 2;
    }
  }
}

std::vector<double> DepthElements::load(const Tissue& tissue, AbsorptionFactors at) const {
  std::vector<double> load(nodes(), 0.0);
  double light = 1.0;  // left at the element's front
  for (std::size_t e = 0; e + 1 < depth_.size(); ++e) {
    // int mu light exp(-mu s) (1 - s / h) ds and the same with s / h, over the element.
    const double x = coefficient(tissue.layers[layer_[e]], at) * (depth_[e + 1] - depth_[e]);
    const double absorbed = -std::expm1(-x);
    // (1 - exp(-x)) / x - exp(-x), the share of the far node; a series where it would cancel.
    const double far = x < 1e-3 ? x * (0.5 - x / 3.0) : absorbed / x - std::exp(-x);
    if (e > 0) load[e - 1] += light * (absorbed - far);
    if (e < nodes()) load[e] += light * far;
    light *= std::exp(-x);
  }
  return load;
}

void DepthElements::add_steps(const RadialTerms& terms, const Sources& sources,
                              const std::vector<double>& times, StepSamples& sum) const {
  constexpr int kSteps = 2;          // between two times
  constexpr double kSettled = 16.0;  // e-folds
  const std::size_t count = sources.count;
  const GramSum gram(sources, nodes());
  for (std::size_t begin = 0; begin < terms.rate.size(); begin += kLanes) {
    const std::size_t lanes = std::min(kLanes, terms.rate.size() - begin);
    std::vector<Pencil> pencils;
    std::vector<std::vector<double>> settled;
    for (std::size_t l = 0; l < kLanes; ++l) {  // the last term again where there are no more
      pencils.push_back(
          pencil_of(depth_, layer_, thermal_, terms.rate[begin + std::min(l, lanes - 1)]));
      settled.push_back(sources.load);
      Symmetric factors = pencils[l].stiffness;
      factors.factorize();
      factors.solve(settled[l], count);
    }
    const auto sample = [&](std::size_t t, std::size_t lane, const double* heat,
                            std::size_t stride) {
      for (std::size_t a = 0; a < count; ++a) {
        sum.peak[t * count + a] += terms.peak[begin + lane] * heat[(peak_ * count + a) * stride];
      }
      gram.add(&sum.gram[t * count * count], heat, stride, terms.volume[begin + lane]);
    };
    Heating heating(pencils, sources);
    for (std::size_t t = 0; t < times.size(); ++t) {
      const auto is_settled = [&](std::size_t l) {
        return pencils[l].slowest * times[t] > kSettled;
      };
      bool all = true;
      for (std::size_t l = 0; l < lanes; ++l) all = all && is_settled(l);
      if (!all) heating.advance(times[t] - (t == 0 ? 0.0 : times[t - 1]), kSteps);
      for (std::size_t l = 0; l < lanes; ++l) {
        if (is_settled(l)) {
          sample(t, l, settled[l].data(), 1);
        } else {
          sample(t, l, heating.lane(l), kLanes);
        }
      }
    }
    for (std::size_t l = 0; l < lanes; ++l) sample(times.size(), l, settled[l].data(), 1);
  }
}

double absorbed_fraction(const Tissue& tissue, AbsorptionFactors at) {
  double optical_depth = 0.0;
  for (const Layer& layer : tissue.layers)
    optical_depth += coefficient(layer, at) * layer.thickness;
  return -std::expm1(-optical_depth);
}

}  // namespace photocoag::crosscheck
