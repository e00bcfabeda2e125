// Role: offline; the picture of a temperature field over radius and depth: isotherms, layers, spot.
// Used by report. Drawn without gnuplot: isotherms of a rotationally symmetric field that falls
// with the radius are one polygon each, small and sharp at every size. Units: K, um on the axes.
// Real-time promise: none. Threads: none.
#pragma once

#include <string>
#include <vector>

#include "photocoag/core/vtk.hpp"

namespace photocoag {

struct FieldView {
  double width = 520.0;  ///< px of the drawing
};

/// Inline SVG with the classes of plot_css. Radius to 4 spot radii, depth to 300 um before and 450
/// um behind the hottest place; the same scale in both directions.
std::string field_svg(const TemperatureField& field, const FieldView& view);

/// The temperatures of the isotherms: about eight equal steps below the highest.
std::vector<double> isotherm_levels(const TemperatureField& field);

/// Radius of an isotherm in one row of cells, m: the outermost place as hot as `level`, between
/// cell centers by interpolation; 0 if the row is colder.
double isotherm_radius(const TemperatureField& field, std::size_t axial, double level);

}  // namespace photocoag
