// Role: offline; the axisymmetric tensor grid of the full-order model. Used by fom.
// Source: paper, section 2 (finite differences there, finite volumes here: docs/equations.md).
// Units: m.
#pragma once

#include <cstddef>
#include <vector>

#include "photocoag/fom/grid_settings.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// One direction of the grid: increasing faces; cell i lies between faces i and i + 1.
struct Axis {
  std::vector<double> faces;

  std::size_t cells() const noexcept { return faces.size() - 1; }
  double width(std::size_t cell) const noexcept { return faces[cell + 1] - faces[cell]; }
  double center(std::size_t cell) const noexcept { return 0.5 * (faces[cell] + faces[cell + 1]); }
};

/// Cells are rings r x z. Faces lie on every layer boundary and on the spot radius.
struct Grid {
  Axis radial;  ///< 0 … domain radius
  Axis axial;   ///< 0 (front of the first layer) … total depth

  std::size_t cells() const noexcept { return radial.cells() * axial.cells(); }
};

/// The grid graded toward the peak layer in depth and toward the spot's edge in radius, with at
/// least settings.min_cells cells. Throws Error if tissue or settings are not valid.
Grid make_grid(const Tissue& tissue, const GridSettings& settings);

/// Every cell halved in both directions: for convergence studies.
Grid refined(const Grid& grid);

}  // namespace photocoag
