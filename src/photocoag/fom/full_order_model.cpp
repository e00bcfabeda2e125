#include "photocoag/fom/full_order_model.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Modes of M^-1 K for two-point fluxes: conductance at an inner face = area * diffusivity /
// distance of the neighbouring centers; at a boundary face (zero temperature rise) the distance is
// to the face. A face of area 0 (the axis r = 0) lets nothing through.
Modes diffusion_modes(const Axis& axis, const VectorXd& measure, const VectorXd& face_area,
                      double diffusivity) {
  const auto cells = static_cast<Index>(axis.cells());
  VectorXd conductance(cells + 1);
  for (Index face = 0; face <= cells; ++face) {
    const double left = face == 0 ? axis.faces[0] : axis.center(face - 1);
    const double right = face == cells ? axis.faces[cells] : axis.center(face);
    conductance[face] = diffusivity * face_area[face] / (right - left);
  }
  const VectorXd root = measure.cwiseSqrt();
  const VectorXd diagonal =
      (conductance.head(cells) + conductance.tail(cells)).cwiseQuotient(measure);
  VectorXd off_diagonal(cells - 1);
  for (Index i = 0; i + 1 < cells; ++i) {
    off_diagonal[i] = -conductance[i + 1] / (root[i] * root[i + 1]);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal, off_diagonal, Eigen::ComputeEigenvectors);
  if (solver.info() != Eigen::Success) throw Error("the heat operator could not be diagonalised");
  return {solver.eigenvalues(), solver.eigenvectors(), root};
}

Modes radial_modes(const Axis& axis, double diffusivity) {
  const auto cells = static_cast<Index>(axis.cells());
  VectorXd area(cells);
  VectorXd circumference(cells + 1);
  for (Index i = 0; i <= cells; ++i) circumference[i] = 2.0 * std::numbers::pi * axis.faces[i];
  for (Index i = 0; i < cells; ++i)
    area[i] = 2.0 * std::numbers::pi * axis.center(i) * axis.width(i);
  return diffusion_modes(axis, area, circumference, diffusivity);
}

Modes axial_modes(const Axis& axis, double diffusivity) {
  const auto cells = static_cast<Index>(axis.cells());
  VectorXd width(cells);
  for (Index i = 0; i < cells; ++i) width[i] = axis.width(i);
  return diffusion_modes(axis, width, VectorXd::Ones(cells + 1), diffusivity);
}

// Value at r = 0 of the even parabola through the first two ring averages.
VectorXd axis_evaluation(const Axis& axis) {
  const auto mean_square = [&axis](std::size_t i) {
    return 0.5 * (axis.faces[i] * axis.faces[i] + axis.faces[i + 1] * axis.faces[i + 1]);
  };
  const double weight = mean_square(0) / (mean_square(1) - mean_square(0));
  VectorXd functional = VectorXd::Zero(static_cast<Index>(axis.cells()));
  functional[0] = 1.0 + weight;
  functional[1] = -weight;
  return functional;
}

// Cubic Lagrange interpolation at depth z through the four nearest cell centers.
VectorXd depth_evaluation(const Axis& axis, double z) {
  const auto cells = static_cast<Index>(axis.cells());
  const auto above = std::upper_bound(axis.faces.begin(), axis.faces.end(), z);
  const Index cell = static_cast<Index>(above - axis.faces.begin()) - 1;
  const Index points = std::min<Index>(4, cells);
  const Index first =
      std::clamp<Index>(z < axis.center(cell) ? cell - 2 : cell - 1, 0, cells - points);
  VectorXd functional = VectorXd::Zero(cells);
  for (Index i = first; i < first + points; ++i) {
    double weight = 1.0;
    for (Index j = first; j < first + points; ++j) {
      if (j != i) weight *= (z - axis.center(j)) / (axis.center(i) - axis.center(j));
    }
    functional[i] = weight;
  }
  return functional;
}

}  // namespace

VectorXd Modes::project_functional(const VectorXd& per_cell) const {
  return vectors.transpose() * per_cell.cwiseQuotient(root_measure);
}

VectorXd Modes::to_cells(const VectorXd& coordinates) const {
  return (vectors * coordinates).cwiseQuotient(root_measure);
}

FullOrderModel::FullOrderModel(const Tissue& tissue, const GridSettings& settings)
    : FullOrderModel(tissue, make_grid(tissue, settings)) {}

FullOrderModel::FullOrderModel(const Tissue& tissue, Grid grid)
    : tissue_(tissue),
      grid_(std::move(grid)),
      radial_(radial_modes(grid_.radial, tissue.diffusivity())),
      axial_(axial_modes(grid_.axial, tissue.diffusivity())) {
  const AbsorptionLaw law(tissue);
  whole_absorption_ = law.whole();
  for (std::size_t j = 0; j < grid_.axial.cells(); ++j) {
    cell_absorption_.push_back(law.between(grid_.axial.faces[j], grid_.axial.faces[j + 1]));
  }
  // The source in ring i, cell j is u * s_j / (pi R_I^2 rho C_p dz_j) inside the spot: per unit of
  // the cell's measure 1 / (pi R_I^2), so the functional's cell value is the ring area over the
  // spot area.
  VectorXd spot = VectorXd::Zero(radial_.size());
  const double spot_area = std::numbers::pi * tissue.spot_radius * tissue.spot_radius;
  for (Index i = 0; i < radial_.size(); ++i) {
    if (grid_.radial.center(i) >= tissue.spot_radius) break;
    spot[i] = radial_.root_measure[i] * radial_.root_measure[i] / spot_area;
  }
  beam_ = radial_.project_functional(spot);
  peak_radial_ = radial_.project_functional(axis_evaluation(grid_.radial));
  peak_axial_ = axial_.project_functional(depth_evaluation(grid_.axial, tissue.peak_depth()));
}

VectorXd FullOrderModel::axial_source(double alpha) const {
  VectorXd absorbed(axial_.size());
  for (Index j = 0; j < axial_.size(); ++j) absorbed[j] = cell_absorption_[j].evaluate(alpha).value;
  return axial_source(absorbed);
}

VectorXd FullOrderModel::axial_source(const VectorXd& absorbed_per_cell) const {
  return axial_.project_functional(absorbed_per_cell);
}

double FullOrderModel::input_gain() const noexcept {
  return tissue_.transmission / tissue_.volumetric_heat_capacity();
}

OutputWeights FullOrderModel::output_weights(double alpha) const {
  const VectorXd source = axial_source(alpha);
  const bool normalized = tissue_.volume_temperature == VolumeTemperature::kNormalized;
  const double norm = normalized ? whole_absorption_.evaluate(alpha).value : 1.0;
  return {input_gain() * peak_axial_.cwiseProduct(source),
          (input_gain() / norm) * source.cwiseAbs2()};
}

}  // namespace photocoag
