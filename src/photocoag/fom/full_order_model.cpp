#include "photocoag/fom/full_order_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/fom/diagonalize.hpp"
#include "photocoag/tissue/beam.hpp"

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Conductance of every face for two-point fluxes: area / sum over both sides of (distance from the
// cell's center to the face / conductivity), which is the harmonic mean of the conductivities and
// exact for a jump at the face. At a boundary face (zero temperature rise) there is one side. A
// face of area 0 (the axis r = 0) lets nothing through.
VectorXd conductances(const Axis& axis, const VectorXd& face_area, const VectorXd& conductivity) {
  const auto cells = static_cast<Index>(axis.cells());
  VectorXd result(cells + 1);
  for (Index face = 0; face <= cells; ++face) {
    double resistance = 0.0;
    if (face > 0) resistance += (axis.faces[face] - axis.center(face - 1)) / conductivity[face - 1];
    if (face < cells) resistance += (axis.center(face) - axis.faces[face]) / conductivity[face];
    result[face] = face_area[face] / resistance;
  }
  return result;
}

// M^(-1/2) (two-point fluxes + diag(sink * measure)) M^(-1/2), symmetric tridiagonal.
struct Tridiagonal {
  VectorXd diagonal;
  VectorXd off_diagonal;
};

Tridiagonal symmetric_operator(const VectorXd& conductance, const VectorXd& root_measure,
                               const VectorXd& sink) {
  const Index cells = root_measure.size();
  Tridiagonal result{
      (conductance.head(cells) + conductance.tail(cells)).cwiseQuotient(root_measure.cwiseAbs2()) +
          sink,
      VectorXd(cells - 1)};
  for (Index i = 0; i + 1 < cells; ++i) {
    result.off_diagonal[i] = -conductance[i + 1] / (root_measure[i] * root_measure[i + 1]);
  }
  return result;
}

Modes modes_of(const Tridiagonal& matrix, const VectorXd& root_measure) {
  SymmetricEigen<double> eigen = diagonalize(matrix.diagonal, matrix.off_diagonal);
  if (!eigen.converged) throw Error("the heat operator could not be diagonalised");
  return {std::move(eigen.values), std::move(eigen.vectors), root_measure};
}

Modes radial_modes(const Axis& axis, double diffusivity) {
  const auto cells = static_cast<Index>(axis.cells());
  VectorXd area(cells);
  VectorXd circumference(cells + 1);
  for (Index i = 0; i <= cells; ++i) circumference[i] = 2.0 * std::numbers::pi * axis.faces[i];
  for (Index i = 0; i < cells; ++i)
    area[i] = 2.0 * std::numbers::pi * axis.center(i) * axis.width(i);
  const VectorXd root = area.cwiseSqrt();
  const VectorXd conductance =
      conductances(axis, circumference, VectorXd::Constant(cells, diffusivity));
  return modes_of(symmetric_operator(conductance, root, VectorXd::Zero(cells)), root);
}

// Thermal data of every axial cell; cells end at layer boundaries.
struct DepthData {
  VectorXd width;  // m
  VectorXd conductivity;
  VectorXd heat_capacity;  // volumetric
  VectorXd perfusion;
};

DepthData depth_data(const Tissue& tissue, const Axis& axis) {
  const auto cells = static_cast<Index>(axis.cells());
  DepthData data{VectorXd(cells), VectorXd(cells), VectorXd(cells), VectorXd(cells)};
  std::size_t layer = 0;
  double back = tissue.layers[0].thickness;
  for (Index j = 0; j < cells; ++j) {
    while (axis.center(j) > back && layer + 1 < tissue.layers.size()) {
      back += tissue.layers[++layer].thickness;
    }
    const ThermalData thermal = tissue.thermal(tissue.layers[layer]);
    data.width[j] = axis.width(j);
    data.conductivity[j] = thermal.conductivity;
    data.heat_capacity[j] = thermal.volumetric_heat_capacity;
    data.perfusion[j] = thermal.perfusion;
  }
  return data;
}

// The operator in depth: conductivity per measure gives 1/s.
Tridiagonal depth_operator_of(const DepthData& data, const Axis& axis, const VectorXd& root_measure,
                              const VectorXd& conductivity) {
  const VectorXd conductance =
      conductances(axis, VectorXd::Ones(data.width.size() + 1), conductivity);
  return symmetric_operator(conductance, root_measure,
                            data.perfusion.cwiseQuotient(data.heat_capacity));
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
  const VectorXd scaled = per_cell.cwiseQuotient(root_measure);
  return vectors.size() == 0 ? scaled : VectorXd(vectors.transpose() * scaled);
}

VectorXd Modes::to_cells(const VectorXd& coordinates) const {
  const VectorXd scaled = vectors.size() == 0 ? coordinates : VectorXd(vectors * coordinates);
  return scaled.cwiseQuotient(root_measure);
}

FullOrderModel::FullOrderModel(const Tissue& tissue, const GridSettings& settings)
    : FullOrderModel(tissue, make_grid(tissue, settings)) {}

FullOrderModel::FullOrderModel(const Tissue& tissue, Grid grid)
    : tissue_(tissue), grid_(std::move(grid)), separable_(tissue.uniform_conduction()) {
  const DepthData depth = depth_data(tissue, grid_.axial);
  if (separable_) {
    const double heat_capacity = depth.heat_capacity[0];
    const double diffusivity = depth.conductivity[0] / heat_capacity;
    const VectorXd root = depth.width.cwiseSqrt();
    input_gain_ = tissue.transmission / heat_capacity;
    radial_ = radial_modes(grid_.radial, diffusivity);
    axial_ = modes_of(
        depth_operator_of(depth, grid_.axial, root, VectorXd::Constant(root.size(), diffusivity)),
        root);
  } else {
    const VectorXd root = depth.width.cwiseProduct(depth.heat_capacity).cwiseSqrt();
    Tridiagonal matrix = depth_operator_of(depth, grid_.axial, root, depth.conductivity);
    input_gain_ = tissue.transmission;
    radial_ = radial_modes(grid_.radial, 1.0);
    axial_ = {VectorXd(), Eigen::MatrixXd(), root};
    depth_operator_ = {depth.conductivity.cwiseQuotient(depth.heat_capacity),
                       std::move(matrix.diagonal), std::move(matrix.off_diagonal)};
  }
  set_absorption_and_beam();
}

FullOrderModel::FullOrderModel(const FullOrderModel& standing, const Tissue& tissue)
    : tissue_(tissue),
      grid_(standing.grid_),
      radial_(standing.radial_),
      axial_(standing.axial_),
      separable_(tissue.uniform_conduction()) {
  tissue.validate();
  const ThermalData thermal = tissue.thermal(tissue.layers.front());
  const ThermalData before = standing.tissue_.thermal(standing.tissue_.layers.front());
  const auto perfused = [](const Tissue& t) {
    return std::any_of(t.layers.begin(), t.layers.end(),
                       [&t](const Layer& layer) { return t.thermal(layer).perfusion != 0.0; });
  };
  if (!separable_ || !standing.separable_ || perfused(tissue) || perfused(standing.tissue_)) {
    throw Error("a shared grid needs layers that conduct alike, without perfusion");
  }
  double depth = 0.0;
  for (const Layer& layer : tissue.layers) depth += layer.thickness;
  constexpr double kRounding = 1e-9;  // of the sums of thicknesses
  if (std::abs(depth - grid_.axial.faces.back()) > kRounding * depth ||
      tissue.domain_radius != standing.tissue_.domain_radius) {
    throw Error("a shared grid needs the same depth and domain radius");
  }
  const double ratio = (thermal.conductivity / thermal.volumetric_heat_capacity) /
                       (before.conductivity / before.volumetric_heat_capacity);
  radial_.rates *= ratio;
  axial_.rates *= ratio;
  input_gain_ = tissue.transmission / thermal.volumetric_heat_capacity;
  set_absorption_and_beam();
}

void FullOrderModel::set_absorption_and_beam() {
  const AbsorptionLaw law(tissue_);
  whole_absorption_ = law.whole();
  for (std::size_t j = 0; j < grid_.axial.cells(); ++j) {
    cell_absorption_.push_back(law.between(grid_.axial.faces[j], grid_.axial.faces[j + 1]));
  }
  // The source in ring i, cell j is u * s_j * share_i per (rho C_p dz_j * ring area): a functional
  // whose cell value is the ring's share of the beam.
  const Beam beam(tissue_);
  VectorXd share(radial_.size());
  for (Index i = 0; i < radial_.size(); ++i) {
    share[i] = beam.share(grid_.radial.faces[i], grid_.radial.faces[i + 1]);
  }
  beam_ = radial_.project_functional(share);
  peak_radial_ = radial_.project_functional(axis_evaluation(grid_.radial));
  peak_axial_ = axial_.project_functional(depth_evaluation(grid_.axial, tissue_.peak_depth()));
}

VectorXd FullOrderModel::axial_source(AbsorptionFactors at) const {
  VectorXd absorbed(axial_.size());
  for (Index j = 0; j < axial_.size(); ++j) {
    absorbed[j] = cell_absorption_[j].evaluate(at).value;
  }
  return axial_source(absorbed);
}

VectorXd FullOrderModel::axial_source(const VectorXd& absorbed_per_cell) const {
  return axial_.project_functional(absorbed_per_cell);
}

double FullOrderModel::volume_norm(AbsorptionFactors at) const noexcept {
  return tissue_.volume_temperature == VolumeTemperature::kNormalized
             ? whole_absorption_.evaluate(at).value
             : 1.0;
}

OutputWeights FullOrderModel::output_weights(AbsorptionFactors at) const {
  const VectorXd source = axial_source(at);
  return {input_gain() * peak_axial_.cwiseProduct(source),
          (input_gain() / volume_norm(at)) * source.cwiseAbs2()};
}

}  // namespace photocoag
