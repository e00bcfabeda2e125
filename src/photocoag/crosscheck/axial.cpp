#include "photocoag/crosscheck/axial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace photocoag::crosscheck {
namespace {

double coefficient(const Layer& layer, AbsorptionFactors at) {
  return layer.absorption * (layer.scaled_by_alpha  ? at.alpha
                             : layer.scaled_by_beta ? at.beta
                                                    : 1.0);
}

/// A symmetric tridiagonal matrix, and its factors L D L^T.
struct Symmetric {
  std::vector<double> diagonal;
  std::vector<double> beside;  // entry i couples i and i + 1

  void factorize() {
    for (std::size_t i = 0; i + 1 < diagonal.size(); ++i) {
      const double ratio = beside[i] / diagonal[i];
      diagonal[i + 1] -= ratio * beside[i];
      beside[i] = ratio;
    }
  }
  /// Of factors; `x` has `count` numbers per row.
  void solve(std::vector<double>& x, std::size_t count) const {
    const std::size_t n = diagonal.size();
    for (std::size_t i = 1; i < n; ++i) {
      for (std::size_t a = 0; a < count; ++a)
        x[i * count + a] -= beside[i - 1] * x[(i - 1) * count + a];
    }
    for (std::size_t i = n; i-- > 0;) {
      const double inverse = 1.0 / diagonal[i];
      for (std::size_t a = 0; a < count; ++a) {
        const double behind = i + 1 < n ? beside[i] * x[(i + 1) * count + a] : 0.0;
        x[i * count + a] = x[i * count + a] * inverse - behind;
      }
    }
  }
};

/// Heat capacity and losses of one radial term: mass T' = load - stiffness T.
struct Pencil {
  Symmetric mass;
  Symmetric stiffness;
  double slowest = std::numeric_limits<double>::infinity();  // 1/s, no mode decays more slowly

  /// mass + h stiffness, factorised.
  Symmetric shifted(double h) const {
    Symmetric sum = stiffness;
    for (std::size_t i = 0; i < sum.diagonal.size(); ++i) {
      sum.diagonal[i] = mass.diagonal[i] + h * sum.diagonal[i];
      if (i + 1 < sum.diagonal.size()) sum.beside[i] = mass.beside[i] + h * sum.beside[i];
    }
    sum.factorize();
    return sum;
  }
};

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

// right -= matrix * x
void subtract_product(const Symmetric& matrix, const std::vector<double>& x, std::size_t count,
                      std::vector<double>& right) {
  const std::size_t n = matrix.diagonal.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double* here = &x[i * count];
    double* out = &right[i * count];
    for (std::size_t a = 0; a < count; ++a) out[a] -= matrix.diagonal[i] * here[a];
    if (i > 0) {
      for (std::size_t a = 0; a < count; ++a) out[a] -= matrix.beside[i - 1] * (here - count)[a];
    }
    if (i + 1 < n) {
      for (std::size_t a = 0; a < count; ++a) out[a] -= matrix.beside[i] * (here + count)[a];
    }
  }
}

/// Alexander's three stages, a_ij of the lower triangle; the last row gives the new value.
struct Alexander {
  static constexpr double kShift = 0.435866521508458999;
  static constexpr double kHalf = 0.5 * (1.0 - kShift);
  static constexpr double kFirst = -0.25 * (6.0 * kShift * kShift - 16.0 * kShift + 1.0);
  static constexpr double kSecond = 0.25 * (6.0 * kShift * kShift - 20.0 * kShift + 5.0);
};

/// Temperature of all nodes and sources, stepped with one size.
class Heating {
 public:
  Heating(const Pencil& pencil, const Sources& sources)
      : pencil_(pencil), sources_(sources), now_(sources.load.size(), 0.0) {}

  void advance(double time, int steps) {
    const double h = time / steps;
    const Symmetric factors = pencil_.shifted(Alexander::kShift * h);
    const double weights[3][2] = {
        {0.0, 0.0}, {Alexander::kHalf, 0.0}, {Alexander::kFirst, Alexander::kSecond}};
    for (int step = 0; step < steps; ++step) {
      for (int stage = 0; stage < 3; ++stage) {
        at_ = now_;
        for (int before = 0; before < stage; ++before) {
          const double weight = h * weights[stage][before];
          for (std::size_t i = 0; i < at_.size(); ++i) at_[i] += weight * slope_[before][i];
        }
        slope_[stage] = sources_.load;
        subtract_product(pencil_.stiffness, at_, sources_.count, slope_[stage]);
        factors.solve(slope_[stage], sources_.count);
      }
      const double weight = h * Alexander::kShift;
      for (std::size_t i = 0; i < now_.size(); ++i) now_[i] = at_[i] + weight * slope_[2][i];
    }
  }
  const std::vector<double>& now() const { return now_; }

 private:
  const Pencil& pencil_;
  const Sources& sources_;
  std::vector<double> now_;
  std::vector<double> at_;
  std::vector<double> slope_[3];
};

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

void DepthElements::add_steps(double rate, double peak_weight, double volume_weight,
                              const Sources& sources, const std::vector<double>& times,
                              StepSamples& sum) const {
  constexpr int kSteps = 2;          // between two times
  constexpr double kSettled = 16.0;  // e-folds
  const std::size_t count = sources.count;
  const Pencil pencil = pencil_of(depth_, layer_, thermal_, rate);
  std::vector<double> settled = sources.load;
  Symmetric factors = pencil.stiffness;
  factors.factorize();
  factors.solve(settled, count);
  const auto sample = [&](std::size_t t, const std::vector<double>& temperature) {
    for (std::size_t a = 0; a < count; ++a) {
      sum.peak[t * count + a] += peak_weight * temperature[peak_ * count + a];
    }
    double* gram = &sum.gram[t * count * count];
    for (std::size_t i = 0; i < nodes(); ++i) {
      const double* heat = &temperature[i * count];
      const double* weight = &sources.load[i * count];
      for (std::size_t a = 0; a < count; ++a) {
        const double scaled = volume_weight * heat[a];
        for (std::size_t b = 0; b < count; ++b) gram[a * count + b] += scaled * weight[b];
      }
    }
  };
  Heating heating(pencil, sources);
  for (std::size_t t = 0; t < times.size(); ++t) {
    if (pencil.slowest * times[t] > kSettled) {
      sample(t, settled);
      continue;
    }
    heating.advance(times[t] - (t == 0 ? 0.0 : times[t - 1]), kSteps);
    sample(t, heating.now());
  }
  sample(times.size(), settled);
}

double absorbed_fraction(const Tissue& tissue, AbsorptionFactors at) {
  double optical_depth = 0.0;
  for (const Layer& layer : tissue.layers)
    optical_depth += coefficient(layer, at) * layer.thickness;
  return -std::expm1(-optical_depth);
}

}  // namespace photocoag::crosscheck
