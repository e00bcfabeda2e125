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
    optical_depth += inside * layer.absorption * (layer.scaled_by_alpha ? alpha : 1.0);
    front += layer.thickness;
  }
  return std::exp(-optical_depth);
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
  const double k = tissue.conductivity;
  DenseOperator op;
  op.A = Eigen::MatrixXd::Zero(nr * nz, nr * nz);
  op.B = Eigen::VectorXd::Zero(nr * nz);
  op.C_volume = Eigen::RowVectorXd::Zero(nr * nz);
  op.C_peak = Eigen::RowVectorXd::Zero(nr * nz);
  op.heat_capacity.resize(nr * nz);
  op.boundary = Eigen::VectorXd::Zero(nr * nz);
  for (int j = 0; j < nz; ++j) {
    for (int i = 0; i < nr; ++i) {
      const int cell = i + j * nr;
      const double area = pi * (r[i + 1] * r[i + 1] - r[i] * r[i]);
      const double height = z[j + 1] - z[j];
      op.heat_capacity[cell] = tissue.density * tissue.heat_capacity * area * height;
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
      const double above = j > 0 ? middle(z, j - 1) : z[0];
      exchange(j > 0 ? cell - nr : -1, k * area / (middle(z, j) - above));
      const double below = j + 1 < nz ? middle(z, j + 1) : z[nz];
      exchange(j + 1 < nz ? cell + nr : -1, k * area / (below - middle(z, j)));
      if (r[i + 1] <= tissue.spot_radius * (1 + 1e-12)) {
        const double share = area / (pi * tissue.spot_radius * tissue.spot_radius);
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
