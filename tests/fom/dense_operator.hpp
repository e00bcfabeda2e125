// Role: tests; the heat equation on a small grid as one dense matrix, assembled ring by ring from
// the balance of heat. Knows nothing of separability, modes or the code under test: only faces,
// layers and material data.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "photocoag/fom/grid.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag::testing {

/// T' = A T + B u, volume = C_volume T, peak = C_peak T; T per cell, index radial + axial * radial
/// cells.
struct DenseOperator {
  Eigen::MatrixXd A;
  Eigen::VectorXd B;
  Eigen::RowVectorXd C_volume;
  Eigen::RowVectorXd C_peak;
  Eigen::VectorXd heat_capacity;  // J/K of each ring
  Eigen::VectorXd boundary;       // W/K from each ring to the outside
};

/// exp(-optical depth) at depth z.
inline double transmitted(const Tissue& tissue, double alpha, double z) {
  double optical_depth = 0.0;
  double front = 0.0;
  for (const Layer& layer : tissue.layers) {
    const double inside = std::clamp(z - front, 0.0, layer.thickness);
    optical_depth +=
        inside * layer.absorption * (layer.scaled_by == ScaledBy::kAlpha ? alpha : 1.0);
    front += layer.thickness;
  }
  return std::exp(-optical_depth);
}

/// The layer at depth z.
inline const Layer& layer_at(const Tissue& tissue, double z) {
  double back = 0.0;
  for (const Layer& layer : tissue.layers) {
    back += layer.thickness;
    if (z < back) return layer;
  }
  return tissue.layers.back();
}

/// Share of a Gaussian's or a table's power between two radii, by brute force: many thin rings.
inline double beam_share(const Tissue& tissue, double inner, double outer) {
  const auto irradiance = [&tissue](double r) {
    const double x = r / tissue.spot_radius;
    if (tissue.beam == BeamProfile::kGaussian) return std::exp(-2.0 * x * x);
    const std::vector<double>& radii = tissue.beam_radii;
    if (r >= radii.back()) return 0.0;
    if (r <= radii.front()) return tissue.beam_intensities.front();
    std::size_t i = 1;
    while (radii[i] < r) ++i;
    const double fraction = (r - radii[i - 1]) / (radii[i] - radii[i - 1]);
    return (1 - fraction) * tissue.beam_intensities[i - 1] + fraction * tissue.beam_intensities[i];
  };
  // Simpson's rule between the kinks.
  std::vector<double> kinks = tissue.beam_radii;
  kinks.insert(kinks.end(), {0.0, tissue.domain_radius});
  std::sort(kinks.begin(), kinks.end());
  const auto integral = [&](double from, double to) {
    constexpr int kPanels = 20000;
    double sum = 0.0;
    for (std::size_t k = 0; k + 1 < kinks.size(); ++k) {
      const double a = std::max(from, kinks[k]);
      const double b = std::min(to, kinks[k + 1]);
      if (a >= b) continue;
      const double h = (b - a) / kPanels;
      for (int i = 0; i < kPanels; ++i) {
        const double r = a + i * h;
        sum += h / 6 *
               (irradiance(r) * r + 4 * irradiance(r + h / 2) * (r + h / 2) +
                irradiance(r + h) * (r + h));
      }
    }
    return sum;
  };
  return integral(inner, outer) / integral(0.0, tissue.domain_radius);
}

inline DenseOperator dense_operator(const Tissue& tissue, const Grid& grid, double alpha) {
  using std::numbers::pi;
  const std::vector<double>& r = grid.radial.faces;
  const std::vector<double>& z = grid.axial.faces;
  const int nr = static_cast<int>(r.size()) - 1;
  const int nz = static_cast<int>(z.size()) - 1;
  const auto middle = [](const std::vector<double>& faces, int i) {
    return (faces[i] + faces[i + 1]) / 2;
  };
  DenseOperator op;
  op.A = Eigen::MatrixXd::Zero(nr * nz, nr * nz);
  op.B = Eigen::VectorXd::Zero(nr * nz);
  op.C_volume = Eigen::RowVectorXd::Zero(nr * nz);
  op.C_peak = Eigen::RowVectorXd::Zero(nr * nz);
  op.heat_capacity.resize(nr * nz);
  op.boundary = Eigen::VectorXd::Zero(nr * nz);
  std::vector<double> beam_shares;
  for (int i = 0; i < nr && tissue.beam != BeamProfile::kFlatTop; ++i) {
    beam_shares.push_back(beam_share(tissue, r[i], r[i + 1]));
  }
  for (int j = 0; j < nz; ++j) {
    for (int i = 0; i < nr; ++i) {
      const int cell = i + j * nr;
      const double area = pi * (r[i + 1] * r[i + 1] - r[i] * r[i]);
      const double height = z[j + 1] - z[j];
      const Layer& layer = layer_at(tissue, middle(z, j));
      const auto conductivity_of = [&tissue](const Layer& of) {
        return of.conductivity.value_or(tissue.conductivity);
      };
      const double k = conductivity_of(layer);
      op.heat_capacity[cell] = layer.density.value_or(tissue.density) *
                               layer.heat_capacity.value_or(tissue.heat_capacity) * area * height;
      const auto exchange = [&](int other, double conductance) {  // W/K
        op.A(cell, cell) -= conductance;
        if (other >= 0) op.A(cell, other) += conductance;
        if (other < 0) op.boundary[cell] += conductance;
      };
      if (i > 0) {
        exchange(cell - 1, k * 2 * pi * r[i] * height / (middle(r, i) - middle(r, i - 1)));
      }
      const double outer = i + 1 < nr ? middle(r, i + 1) : r[nr];
      exchange(i + 1 < nr ? cell + 1 : -1, k * 2 * pi * r[i + 1] * height / (outer - middle(r, i)));
      // Two slabs in series: m2 K/W from center to face and from face to center.
      const auto half = [&](int of) {
        return 0.5 * (z[of + 1] - z[of]) / conductivity_of(layer_at(tissue, middle(z, of)));
      };
      exchange(j > 0 ? cell - nr : -1, area / (half(j) + (j > 0 ? half(j - 1) : 0.0)));
      exchange(j + 1 < nz ? cell + nr : -1, area / (half(j) + (j + 1 < nz ? half(j + 1) : 0.0)));
      op.A(cell, cell) -= layer.perfusion * area * height;  // W/K
      const bool flat = tissue.beam == BeamProfile::kFlatTop;
      if (!flat || r[i + 1] <= tissue.spot_radius * (1 + 1e-12)) {
        const double share =
            flat ? area / (pi * tissue.spot_radius * tissue.spot_radius) : beam_shares[i];
        const double absorbed =
            transmitted(tissue, alpha, z[j]) - transmitted(tissue, alpha, z[j + 1]);
        op.B[cell] = tissue.transmission * share * absorbed;  // W per W
        op.C_volume[cell] = share * absorbed;
      }
    }
  }
  if (tissue.volume_temperature == VolumeTemperature::kNormalized) op.C_volume /= op.C_volume.sum();
  op.A = (op.heat_capacity.cwiseInverse().asDiagonal() * op.A).eval();
  op.B = op.B.cwiseQuotient(op.heat_capacity);
  // Peak: the cubic through the four nearest centers in depth; at r = 0 the even parabola c0 + c1
  // r^2 whose averages over the first two rings are their temperatures.
  const double depth = tissue.peak_depth();
  std::vector<int> nearest(nz);
  for (int j = 0; j < nz; ++j) nearest[j] = j;
  std::stable_sort(nearest.begin(), nearest.end(), [&](int a, int b) {
    return std::abs(middle(z, a) - depth) < std::abs(middle(z, b) - depth);
  });
  Eigen::Matrix4d vandermonde;
  for (int n = 0; n < 4; ++n) {
    for (int power = 0; power < 4; ++power) {
      vandermonde(power, n) = std::pow((middle(z, nearest[n]) - depth) * 1e5, power);
    }
  }
  const Eigen::Vector4d in_depth = vandermonde.fullPivLu().solve(Eigen::Vector4d::Unit(0));
  Eigen::Matrix2d parabola;
  for (int i = 0; i < 2; ++i) {
    parabola(i, 0) = 1.0;
    parabola(i, 1) = (r[i] * r[i] + r[i + 1] * r[i + 1]) / 2 * 1e10;
  }
  const Eigen::RowVector2d on_axis = parabola.inverse().row(0);
  for (int n = 0; n < 4; ++n) {
    for (int i = 0; i < 2; ++i) op.C_peak[i + nearest[n] * nr] = in_depth[n] * on_axis[i];
  }
  return op;
}

/// 9 x 13 cells with a face on every layer boundary of the default tissue and on the spot's edge;
/// the peak's depth is no cell's center, where any interpolation would be right.
inline Grid small_grid() {
  Grid grid;
  grid.radial.faces = {0.0, 30e-6, 60e-6, 80e-6, 100e-6, 130e-6, 200e-6, 400e-6, 900e-6, 2000e-6};
  grid.axial.faces = {0.0,    100e-6, 170e-6, 190e-6, 191.5e-6, 194.2e-6, 196e-6,
                      200e-6, 220e-6, 270e-6, 400e-6, 600e-6,   900e-6,   1300e-6};
  return grid;
}

}  // namespace photocoag::testing
