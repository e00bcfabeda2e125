// Role: setup; the tissue a model is built from. Used by fom, mor, rom and the configuration.
// Source: paper, section 2 (equation numbers in docs/equations.md).
// Units: SI. All temperatures are rises over ambient unless the name says absolute.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

struct Field;  // core/setting.hpp

/// The factors that scale layers' absorption: the parameters of a reduced model, in this order.
enum class ScaledBy {
  kNothing,  ///< mu = absorption
  kAlpha,    ///< mu = alpha * absorption, alpha the absorption factor (RPE)
  kBeta,     ///< mu = beta * absorption, beta the choroid factor
};

inline constexpr std::size_t kMaxParameters = 2;

/// "none", "alpha", "beta".
std::string_view to_string(ScaledBy value) noexcept;

/// One layer of the eye fundus; the light meets the layers in the order in which they are listed.
struct Layer {
  std::string name;
  double thickness = 0.0;   ///< m, above 0, at most 0.02
  double absorption = 0.0;  ///< 1/m, from 0 to 1e7; the reference value if it is scaled
  ScaledBy scaled_by = ScaledBy::kNothing;
  std::optional<double> conductivity = {};   ///< W/(m K), else the tissue's
  std::optional<double> density = {};        ///< kg/m3, else the tissue's
  std::optional<double> heat_capacity = {};  ///< J/(kg K), else the tissue's
  double perfusion = 0.0;  ///< W/(m3 K), from 0 to 1e8; w_b rho_b c_b: heat that blood at ambient
                           ///< removes per volume and kelvin (Pennes 1948)

  bool operator==(const Layer&) const = default;
};

/// A layer's thermal data with the tissue's values where it has none of its own.
struct ThermalData {
  double conductivity = 0.0;              ///< W/(m K)
  double volumetric_heat_capacity = 0.0;  ///< rho C_p, J/(m3 K)
  double perfusion = 0.0;                 ///< W/(m3 K)
};

/// The beam's irradiance over the radius, normalised to unit power (tissue/beam.hpp).
enum class BeamProfile {
  kFlatTop,   ///< the paper's: constant inside the spot radius
  kGaussian,  ///< exp(-2 r^2 / spot_radius^2)
  kTable,     ///< linear between the entries of beam_radii, beam_intensities; 0 beyond the last
};

std::string_view to_string(BeamProfile value) noexcept;

/// Definition of the volume temperature.
enum class VolumeTemperature {
  kAbsorptionWeighted,  ///< the paper's C_vol: integral of mu exp(-int mu) * mean over the spot
  kNormalized,  ///< the same divided by the absorbed fraction: as measured after a calibration at
                ///< uniform temperature
};

std::string_view to_string(VolumeTemperature value) noexcept;

inline constexpr std::size_t kMaxBeamEntries = 256;

/// Tissue, beam and thermal data. Defaults: see docs/equations.md for the source of each.
struct Tissue {
  double ambient_celsius = 22.0;  ///< deg C, -10 to 60: absolute temperature = ambient + rise
  double domain_radius = 2.0e-3;  ///< m; R, zero temperature rise there; above the spot radius
  double spot_radius = 100.0e-6;  ///< m; R_I of the flat top, 1/e2 radius of the Gaussian; the grid
                                  ///< is finest there
  BeamProfile beam = BeamProfile::kFlatTop;
  std::vector<double> beam_radii;        ///< m, ascending from 0 or more; for kTable, else empty
  std::vector<double> beam_intensities;  ///< relative, one per radius
  double transmission = 1.0;      ///< power at the fundus / commanded power, above 0, at most 1
  double density = 993.0;         ///< kg/m3
  double heat_capacity = 4176.0;  ///< J/(kg K)
  double conductivity = 0.627;    ///< W/(m K)
  VolumeTemperature volume_temperature = VolumeTemperature::kAbsorptionWeighted;
  std::string peak_layer = "RPE";  ///< the layer whose mid-depth is z_center
  std::vector<Layer> layers = {
      {"retina", 190.0e-6, 0.0},    {"RPE", 6.0e-6, 120400.0, ScaledBy::kAlpha},
      {"unpigmented", 4.0e-6, 0.0}, {"choroid", 400.0e-6, 2662.2},
      {"sclera", 700.0e-6, 0.0},
  };

  /// rho C_p of layers without data of their own, J/(m3 K)
  double volumetric_heat_capacity() const noexcept { return density * heat_capacity; }
  ThermalData thermal(const Layer& layer) const noexcept;
  /// True if a layer's absorption depends on the choroid factor beta: two parameters.
  bool two_parameters() const noexcept;
  /// True if all layers conduct and store heat alike; perfusion may differ.
  bool uniform_conduction() const noexcept;
  /// a = k / (rho C_p) of layers without data of their own, m2/s
  double diffusivity() const noexcept { return conductivity / volumetric_heat_capacity(); }
  /// Sum of all thicknesses, m.
  double depth() const noexcept;
  /// z_center, m: mid-depth of peak_layer. Throws Error if there is no such layer.
  double peak_depth() const;
  /// Throws Error naming the key below `prefix` (e.g. "tissue"), the value and the range.
  void validate(std::string_view prefix = "tissue") const;

  bool operator==(const Tissue&) const = default;
};

/// The keys of a tissue below `prefix`, bound to `tissue`; those inside layers: layer_fields.
std::vector<Field> fields_of(Tissue& tissue, std::string_view prefix);

/// The keys of one layer, below `prefix` (e.g. "tissue.layers.RPE").
std::vector<Field> layer_fields(Layer& layer, std::string_view prefix);

}  // namespace photocoag
