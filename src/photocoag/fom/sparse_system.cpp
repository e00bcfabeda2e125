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

// Distance over which the temperature falls across a face: between the centers next to it, at the
// boundary from the center to the face.
double distance_across(const Axis& axis, std::size_t face) {
  const double before = face == 0 ? axis.faces[0] : axis.center(face - 1);
  const double behind = face == axis.cells() ? axis.faces[face] : axis.center(face);
  return behind - before;
}

// Cell values of a tensor product, radial index fastest.
VectorXd outer(const VectorXd& radial, const VectorXd& axial) {
  const Eigen::MatrixXd product = radial * axial.transpose();
  return product.reshaped();
}

// A functional's weight per cell from its coordinates: M^(1/2) U c.
VectorXd functional_of_cells(const Modes& modes, const VectorXd& coordinates) {
  return (modes.vectors * coordinates).cwiseProduct(modes.root_measure);
}

}  // namespace

SparseSystem assemble_sparse_system(const FullOrderModel& model) {
  const Axis& radial = model.grid().radial;
  const Axis& axial = model.grid().axial;
  const double diffusivity = model.tissue().diffusivity();
  const auto rings = static_cast<Index>(radial.cells());
  const auto cells = static_cast<Index>(model.states());
  SparseSystem system{VectorXd(cells), Eigen::SparseMatrix<double>(cells, cells)};
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(5 * cells));
  for (std::size_t j = 0; j < axial.cells(); ++j) {
    for (std::size_t i = 0; i < radial.cells(); ++i) {
      const Index cell = static_cast<Index>(i) + static_cast<Index>(j) * rings;
      const double area = area_of_ring(radial, i);
      system.E[cell] = area * axial.width(j);
      const auto side = [&](std::size_t face) {
        return diffusivity * 2.0 * std::numbers::pi * radial.faces[face] * axial.width(j) /
               distance_across(radial, face);
      };
      const auto end = [&](std::size_t face) {
        return diffusivity * area / distance_across(axial, face);
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
      double outflow = 0.0;
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

VectorXd input_of_cells(const FullOrderModel& model, double alpha) {
  return model.input_gain() * outer(model.radial().to_cells(model.beam()),
                                    model.axial().to_cells(model.axial_source(alpha)));
}

VectorXd peak_of_cells(const FullOrderModel& model) {
  return outer(functional_of_cells(model.radial(), model.peak_radial()),
               functional_of_cells(model.axial(), model.peak_axial()));
}

VectorXd volume_of_cells(const FullOrderModel& model, double alpha) {
  double absorbed = 1.0;
  if (model.tissue().volume_temperature == VolumeTemperature::kNormalized) {
    absorbed = AbsorptionLaw(model.tissue()).whole().evaluate(alpha).value;
  }
  return outer(functional_of_cells(model.radial(), model.beam()),
               functional_of_cells(model.axial(), model.axial_source(alpha))) /
         absorbed;
}

}  // namespace photocoag
