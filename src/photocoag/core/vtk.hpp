// Role: offline; a temperature field over depth and radius as a VTK file (XML rectilinear grid,
// .vtr) that ParaView opens, and back. Used by run, report. Source: VTK file formats, XML. Units:
// in the names. Real-time promise: none.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

/// Temperature rise per cell of an axisymmetric grid at one instant, with what a figure needs.
struct TemperatureField {
  std::vector<double> radius_m;           ///< faces, ascending; VTK's x
  std::vector<double> depth_m;            ///< faces, ascending along the light; VTK's y
  std::vector<float> temperature_rise_K;  ///< per cell, radius fastest
  double time_s = 0.0;
  double spot_radius_m = 0.0;
  std::vector<double> layer_back_m;      ///< depth at which each layer ends
  std::vector<std::string> layer_names;  ///< as many

  std::size_t radial_cells() const noexcept { return radius_m.size() - 1; }
  std::size_t axial_cells() const noexcept { return depth_m.size() - 1; }
  double at(std::size_t radial, std::size_t axial) const noexcept {
    return static_cast<double>(temperature_rise_K[radial + axial * radial_cells()]);
  }
};

/// The text of a .vtr file: cell data in base64, no compression. The same field gives the same
/// bytes.
std::string to_vtr(const TemperatureField& field);

/// Reads what to_vtr wrote; not a general reader. Throws Error naming `where` and what is wrong.
TemperatureField from_vtr(std::string_view text, const std::string& where);

/// The text of a .pvd file: the series of .vtr files with their times, s.
std::string to_pvd(const std::vector<std::string>& files, const std::vector<double>& times_s);

}  // namespace photocoag
