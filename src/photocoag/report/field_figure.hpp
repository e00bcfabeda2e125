// Role: offline; the figure of a temperature field over radius and depth: isotherms, layers, spot.
// Used by report. Units: K, um on the axes. Real-time promise: none. Threads: none.
#pragma once

#include "photocoag/core/vtk.hpp"
#include "photocoag/page/figure.hpp"

namespace photocoag {

/// Radius to 4 spot radii on both sides, depth to 300 um before and 450 um behind the hottest
/// place; the same scale in both directions. About eight isotherms below the highest temperature.
Figure field_figure(const TemperatureField& field);

}  // namespace photocoag
