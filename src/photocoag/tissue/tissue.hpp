// Role: setup; the tissue a model is built from. Used by fom, mor, rom and the configuration.
// Source: paper, section 2 (equation numbers in docs/equations.md).
// Units: SI. All temperatures are rises over ambient unless the name says absolute.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

/// One layer of the eye fundus; the light meets the layers in the order in which they are listed.
struct Layer {
  std::string name;
  double thickness = 0.0;        ///< m, above 0, at most 0.02
  double absorption = 0.0;       ///< 1/m, from 0 to 1e7; the reference value if scaled_by_alpha
  bool scaled_by_alpha = false;  ///< mu = alpha * absorption instead of mu = absorption

  bool operator==(const Layer&) const = default;
};

/// Which mean over depth and spot is called "volume temperature".
enum class VolumeTemperature {
  kAbsorptionWeighted,  ///< the paper's C_vol: integral of mu exp(-int mu) * mean over the spot
  kNormalized,          ///< the same divided by the absorbed fraction: what a calibration at
                        ///< uniform temperature measures
};

std::string_view to_string(VolumeTemperature value) noexcept;

/// Tissue, beam and thermal data. Defaults: see docs/equations.md for the source of each.
struct Tissue {
  double ambient_celsius = 22.0;  ///< deg C, -10 to 60: absolute temperature = ambient + rise
  double domain_radius = 2.0e-3;  ///< m; R, zero temperature rise there; above the spot radius
  double spot_radius = 100.0e-6;  ///< m; R_I, flat-top beam
  double transmission = 1.0;      ///< power at the fundus / commanded power, above 0, at most 1
  double density = 993.0;         ///< kg/m3
  double heat_capacity = 4176.0;  ///< J/(kg K)
  double conductivity = 0.627;    ///< W/(m K)
  VolumeTemperature volume_temperature = VolumeTemperature::kAbsorptionWeighted;
  std::string peak_layer = "RPE";  ///< the layer whose mid-depth is z_center
  std::vector<Layer> layers = {
      {"retina", 190.0e-6, 0.0, false},    {"RPE", 6.0e-6, 120400.0, true},
      {"unpigmented", 4.0e-6, 0.0, false}, {"choroid", 400.0e-6, 2662.2, false},
      {"sclera", 700.0e-6, 0.0, false},
  };

  /// rho C_p, J/(m3 K)
  double volumetric_heat_capacity() const noexcept { return density * heat_capacity; }
  /// a = k / (rho C_p), m2/s
  double diffusivity() const noexcept { return conductivity / volumetric_heat_capacity(); }
  /// Sum of all thicknesses, m.
  double depth() const noexcept;
  /// z_center, m: mid-depth of peak_layer. Throws Error if there is no such layer.
  double peak_depth() const;
  /// Throws Error naming the key below `prefix` (e.g. "tissue"), the value and the range.
  void validate(std::string_view prefix = "tissue") const;

  bool operator==(const Tissue&) const = default;
};

}  // namespace photocoag
