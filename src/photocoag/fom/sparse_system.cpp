#include "photocoag/fom/sparse_system.hpp"

#include <array>
#include <numbers>
#include <vector>

namespace photocoag {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

double area_of_ring(const Axis& radial, std::size_t i) {
  return 2.0 * std::numbers::pi * radial.center(i) * radial.width(i);
}

// Distances from the centers on both sides of a face to the face; 0 outside the domain.
struct Sides {
  double before;
  double behind;
};

Sides sides_of(const Axis& axis, std::size_t face) {
  return {face == 0 ? 0.0 : axis.faces[face] - axis.center(face - 1),
          face == axis.cells() ? 0.0 : axis.center(face) - axis.faces[face]};
}

// Thermal data of each depth cell; no cell reaches over a layer's boundary.
std::vector<ThermalData> thermal_of_cells(const Tissue& tissue, const Axis& axial) {
  std::vector<ThermalData> cells;
  std::size_t layer = 0;
  double back = tissue.layers[0].thickness;
  for (std::size_t j = 0; j < axial.cells(); ++j) {
    while (axial.center(j) > back && layer + 1 < tissue.layers.size()) {
      back += tissue.layers[++layer].thickness;
    }
    cells.push_back(tissue.thermal(tissue.layers[layer]));
  }
  return cells;
}

// Cell values of a tensor product, radial index fastest.
VectorXd outer(const VectorXd& radial, const VectorXd& axial) {
  const Eigen::MatrixXd product = radial * axial.transpose();
  return product.reshaped();
}

// A functional's weight per cell from its coordinates: M^(1/2) U c.
VectorXd functional_of_cells(const Modes& modes, const VectorXd& coordinates) {
  const VectorXd values =
      modes.vectors.size() == 0 ? coordinates : VectorXd(modes.vectors * coordinates);
  return values.cwiseProduct(modes.root_measure);
}

}  // namespace

SparseSystem assemble_sparse_system(const FullOrderModel& model) {
  const Axis& radial = model.grid().radial;
  const Axis& axial = model.grid().axial;
  const std::vector<ThermalData> thermal = thermal_of_cells(model.tissue(), axial);
  // Divided by the tissue's heat capacity, or by 1 J/(m3 K) where it differs between layers, as the
  // model's input gain is.
  const double reference = model.separable() ? model.tissue().volumetric_heat_capacity() : 1.0;
  const auto rings = static_cast<Index>(radial.cells());
  const auto cells = static_cast<Index>(model.states());
  SparseSystem system{VectorXd(cells), Eigen::SparseMatrix<double>(cells, cells)};
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(5 * cells));
  for (std::size_t j = 0; j < axial.cells(); ++j) {
    for (std::size_t i = 0; i < radial.cells(); ++i) {
      const Index cell = static_cast<Index>(i) + static_cast<Index>(j) * rings;
      const double area = area_of_ring(radial, i);
      const double volume = area * axial.width(j);
      system.E[cell] = volume * thermal[j].volumetric_heat_capacity / reference;
      const auto side = [&](std::size_t face) {
        const Sides sides = sides_of(radial, face);
        return thermal[j].conductivity / reference * 2.0 * std::numbers::pi * radial.faces[face] *
               axial.width(j) / (sides.before + sides.behind);
      };
      const auto end = [&](std::size_t face) {
        const Sides sides = sides_of(axial, face);
        const double before = face == 0 ? 0.0 : sides.before / thermal[face - 1].conductivity;
        const double behind =
            face == axial.cells() ? 0.0 : sides.behind / thermal[face].conductivity;
        return area / (before + behind) / reference;
      };
      struct Face {
        double conductance;
        bool inner;
        Index neighbour;
      };
      const std::array<Face, 4> faces{{{side(i), i > 0, cell - 1},
                                       {side(i + 1), i + 1 < radial.cells(), cell + 1},
                                       {end(j), j > 0, cell - rings},
                                       {end(j + 1), j + 1 < axial.cells(), cell + rings}}};
      double outflow = thermal[j].perfusion * volume / reference;
      for (const Face& face : faces) {
        outflow += face.conductance;
        if (face.inner) entries.emplace_back(cell, face.neighbour, face.conductance);
      }
      entries.emplace_back(cell, cell, -outflow);
    }
  }
  system.A.setFromTriplets(entries.begin(), entries.end());
  return system;
}

VectorXd input_of_cells(const FullOrderModel& model, AbsorptionFactors at) {
  return model.input_gain() * outer(model.radial().to_cells(model.beam()),
                                    model.axial().to_cells(model.axial_source(at)));
}

VectorXd peak_of_cells(const FullOrderModel& model) {
  return outer(functional_of_cells(model.radial(), model.peak_radial()),
               functional_of_cells(model.axial(), model.peak_axial()));
}

VectorXd volume_of_cells(const FullOrderModel& model, AbsorptionFactors at) {
  double absorbed = 1.0;
  if (model.tissue().volume_temperature == VolumeTemperature::kNormalized) {
    absorbed = AbsorptionLaw(model.tissue()).whole().evaluate(at).value;
  }
  return outer(functional_of_cells(model.radial(), model.beam()),
               functional_of_cells(model.axial(), model.axial_source(at))) /
         absorbed;
}

}  // namespace photocoag
