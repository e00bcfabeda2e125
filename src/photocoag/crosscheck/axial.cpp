#include "photocoag/crosscheck/axial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/wide_vectors.hpp"

namespace photocoag::crosscheck {
namespace {

double coefficient(const Layer& layer, AbsorptionFactors at) {
  return layer.absorption * (layer.scaled_by == ScaledBy::kAlpha  ? at.alpha
                             : layer.scaled_by == ScaledBy::kBeta ? at.beta
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

/// Alexander's three stages, a_ij of the lower triangle; the last row gives the new value.
struct Alexander {
  static constexpr double kShift = 0.435866521508458999;
  static constexpr double kHalf = 0.5 * (1.0 - kShift);
  static constexpr double kFirst = -0.25 * (6.0 * kShift * kShift - 16.0 * kShift + 1.0);
  static constexpr double kSecond = 0.25 * (6.0 * kShift * kShift - 20.0 * kShift + 5.0);
};

/// So many radial terms are stepped side by side, each with the operations of one alone.
constexpr std::size_t kLanes = 4;

/// Of kLanes matrices: number i of each, then number i + 1.
struct Lanes {
  std::vector<double> diagonal;
  std::vector<double> beside;

  explicit Lanes(std::size_t nodes) : diagonal(nodes * kLanes), beside(nodes * kLanes) {}
  void take(std::size_t lane, const Symmetric& matrix) {
    for (std::size_t i = 0; i < matrix.diagonal.size(); ++i) {
      diagonal[i * kLanes + lane] = matrix.diagonal[i];
      beside[i * kLanes + lane] = matrix.beside[i];
    }
  }
};

/// What one stage of a step reads and writes: temperatures and slopes node by node, source by
/// source, kLanes numbers each. Null: not of this stage.
struct Stage {
  const double* now;
  const double* first;
  const double* second;
  double first_weight;
  double second_weight;
  double* at;
  double* slope;
};

/// at = now + weighted slopes; slope = shifted^-1 (load - stiffness at). Of the factors `inverse`
/// is one over the diagonal.
PHOTOCOAG_WIDE_VECTORS
void solve_stage(const Stage& stage, const double* load, std::size_t nodes, std::size_t count,
                 const double* diagonal, const double* beside, const double* inverse,
                 const double* ratio) {
  const std::size_t row = count * kLanes;
  const auto [now, first, second, first_weight, second_weight, at, slope] = stage;
  for (std::size_t k = 0; k < nodes * row; ++k) at[k] = now[k];
  if (first != nullptr) {
    for (std::size_t k = 0; k < nodes * row; ++k) at[k] += first_weight * first[k];
  }
  if (second != nullptr) {
    for (std::size_t k = 0; k < nodes * row; ++k) at[k] += second_weight * second[k];
  }
  for (std::size_t i = 0; i < nodes; ++i) {
    const double* here = at + i * row;
    double* out = slope + i * row;
    const double* own = diagonal + i * kLanes;
    const double* after = beside + i * kLanes;
    for (std::size_t a = 0; a < count; ++a) {
      double sum[kLanes];
      for (std::size_t l = 0; l < kLanes; ++l) {
        sum[l] = load[i * count + a] - own[l] * here[a * kLanes + l];
      }
      if (i > 0) {
        const double* before = after - kLanes;
        for (std::size_t l = 0; l < kLanes; ++l) {
          sum[l] -= before[l] * (here - row)[a * kLanes + l];
        }
      }
      if (i + 1 < nodes) {
        for (std::size_t l = 0; l < kLanes; ++l) sum[l] -= after[l] * (here + row)[a * kLanes + l];
      }
      if (i > 0) {
        const double* factor = ratio + (i - 1) * kLanes;
        for (std::size_t l = 0; l < kLanes; ++l) {
          sum[l] -= factor[l] * (out - row)[a * kLanes + l];
        }
      }
      for (std::size_t l = 0; l < kLanes; ++l) out[a * kLanes + l] = sum[l];
    }
  }
  for (std::size_t i = nodes; i-- > 0;) {
    double* out = slope + i * row;
    const double* one = inverse + i * kLanes;
    const double* factor = ratio + i * kLanes;
    for (std::size_t a = 0; a < count; ++a) {
      double behind[kLanes] = {};
      if (i + 1 < nodes) {
        for (std::size_t l = 0; l < kLanes; ++l) {
          behind[l] = factor[l] * (out + row)[a * kLanes + l];
        }
      }
      for (std::size_t l = 0; l < kLanes; ++l) {
        out[a * kLanes + l] = out[a * kLanes + l] * one[l] - behind[l];
      }
    }
  }
}

/// Temperatures of all nodes, sources and lanes, stepped with one size.
class Heating {
 public:
  Heating(const std::vector<Pencil>& pencils, const Sources& sources)
      : pencils_(pencils),
        sources_(sources),
        nodes_(pencils.front().mass.diagonal.size()),
        stiffness_(nodes_),
        factors_(nodes_),
        now_(sources.load.size() * kLanes, 0.0),
        at_(now_.size()),
        slope_{now_, now_, now_} {
    for (std::size_t l = 0; l < kLanes; ++l) stiffness_.take(l, pencils[l].stiffness);
  }

  void advance(double time, int steps) {
    const double h = time / steps;
    for (std::size_t l = 0; l < kLanes; ++l) {
      factors_.take(l, pencils_[l].shifted(Alexander::kShift * h));
    }
    for (double& value : factors_.diagonal) value = 1.0 / value;
    const auto solve = [&](const Stage& stage) {
      solve_stage(stage, sources_.load.data(), nodes_, sources_.count, stiffness_.diagonal.data(),
                  stiffness_.beside.data(), factors_.diagonal.data(), factors_.beside.data());
    };
    double* const slopes[] = {slope_[0].data(), slope_[1].data(), slope_[2].data()};
    for (int step = 0; step < steps; ++step) {
      solve({now_.data(), nullptr, nullptr, 0.0, 0.0, at_.data(), slopes[0]});
      solve({now_.data(), slopes[0], nullptr, h * Alexander::kHalf, 0.0, at_.data(), slopes[1]});
      solve({now_.data(), slopes[0], slopes[1], h * Alexander::kFirst, h * Alexander::kSecond,
             at_.data(), slopes[2]});
      const double weight = h * Alexander::kShift;
      for (std::size_t k = 0; k < now_.size(); ++k) now_[k] = at_[k] + weight * slopes[2][k];
    }
  }
  /// Of one lane, node by node and source by source.
  void read(std::size_t lane, std::vector<double>& temperature) const {
    for (std::size_t k = 0; k < temperature.size(); ++k) temperature[k] = now_[k * kLanes + lane];
  }

 private:
  const std::vector<Pencil>& pencils_;
  const Sources& sources_;
  std::size_t nodes_;
  Lanes stiffness_;
  Lanes factors_;
  std::vector<double> now_;
  std::vector<double> at_;
  std::vector<double> slope_[3];
};

/// gram += weight heat load', node after node.
PHOTOCOAG_WIDE_VECTORS
void add_gram(double* __restrict gram, const double* __restrict heat, const double* __restrict load,
              std::size_t nodes, std::size_t count, double weight) {
  for (std::size_t i = 0; i < nodes; ++i) {
    for (std::size_t a = 0; a < count; ++a) {
      const double scaled = weight * heat[i * count + a];
      for (std::size_t b = 0; b < count; ++b) gram[a * count + b] += scaled * load[i * count + b];
    }
  }
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
  std::vector<double> temperature(sources.load.size());
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
    const auto sample = [&](std::size_t t, std::size_t lane, const std::vector<double>& heat) {
      for (std::size_t a = 0; a < count; ++a) {
        sum.peak[t * count + a] += terms.peak[begin + lane] * heat[peak_ * count + a];
      }
      add_gram(&sum.gram[t * count * count], heat.data(), sources.load.data(), nodes(), count,
               terms.volume[begin + lane]);
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
          sample(t, l, settled[l]);
          continue;
        }
        heating.read(l, temperature);
        sample(t, l, temperature);
      }
    }
    for (std::size_t l = 0; l < lanes; ++l) sample(times.size(), l, settled[l]);
  }
}

double absorbed_fraction(const Tissue& tissue, AbsorptionFactors at) {
  double optical_depth = 0.0;
  for (const Layer& layer : tissue.layers)
    optical_depth += coefficient(layer, at) * layer.thickness;
  return -std::expm1(-optical_depth);
}

}  // namespace photocoag::crosscheck
