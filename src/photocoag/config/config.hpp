// Role: setup; the complete configuration of a run (docs/configuration.md lists every key).
// Boundary: TOML keys carry their unit (period_ms, peak_max_K); everything here is SI.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/prior.hpp"
#include "photocoag/core/discretization.hpp"
#include "photocoag/core/intersample.hpp"
#include "photocoag/estimation/settings.hpp"
#include "photocoag/fom/grid_settings.hpp"
#include "photocoag/mor/settings.hpp"
#include "photocoag/mpc/settings.hpp"
#include "photocoag/photoacoustics/settings.hpp"
#include "photocoag/safety/settings.hpp"
#include "photocoag/tissue/absorption.hpp"
#include "photocoag/tissue/tissue.hpp"

namespace photocoag {

/// The controller's model.
struct ModelSettings {
  std::string file;  ///< a reduced model made by `photocoag reduce`; empty: reduce now (cached)
  ReductionSettings reduction;
  Discretization discretization = Discretization::kZeroOrderHold;
  bool operator==(const ModelSettings&) const = default;
};

enum class PlantModel { kFull, kReduced };

/// Sample of a period without power.
enum class ZeroPowerSample {
  kMeasured,  ///< a sample: a second laser probes
  kMissing,   ///< nothing: a single laser measures only while it emits
};

/// Power that is reported as applied in a period.
enum class PowerReadback {
  kEmitted,  ///< the mean that the laser emitted
  kNone,     ///< the command: nothing measures the light
};

/// Deviations of a real bench from an ideal eye.
struct BenchSettings {
  IntersampleTiming timing;  ///< fractions of a period, each 0 to 1
  PowerReadback readback = PowerReadback::kEmitted;
  double power_gain = 1.0;        ///< emitted / commanded, 0.5 to 2
  double sample_gain = 1.0;       ///< measured / true volume temperature, 0.5 to 2
  double sample_offset = 0.0;     ///< K, added to the sample; -50 to 50
  double absorption_drift = 0.0;  ///< 1/s, of alpha relative to its first value; -10 to 10

  /// True if samples fall between the ends of periods or the absorption drifts.
  bool needs_intersample() const noexcept { return !timing.plain() || absorption_drift != 0.0; }
  bool operator==(const BenchSettings&) const = default;
};

/// The simulated eye.
struct PlantSettings {
  PlantModel model = PlantModel::kFull;
  double absorption_factor = 1.1;  ///< 1, the true alpha, 0.05 to 5
  double choroid_factor = 1.0;     ///< 1, the true beta, 0.05 to 20; 1 if no layer scales with it
  double noise = 0.288;            ///< K, standard deviation of the sample; 0 to 20
  ZeroPowerSample zero_power_sample = ZeroPowerSample::kMeasured;
  BenchSettings bench;
  Discretization discretization = Discretization::kZeroOrderHold;
  Tissue tissue;                ///< [tissue] with the differences of [plant.tissue] applied
  bool tissue_differs = false;  ///< true if [plant.tissue] was given

  AbsorptionFactors absorption() const noexcept { return {absorption_factor, choroid_factor}; }
  bool operator==(const PlantSettings&) const = default;
};

/// How far the eye may differ from [tissue], relative, either way; 0: not declared.
struct UncertaintySettings {
  double spot_radius = 0.0;  ///< 0 to 0.5
  double thickness = 0.0;    ///< of every layer, independently; 0 to 0.5
  double absorption = 0.0;   ///< of every layer that alpha does not scale; 0 to 0.5

  bool declared() const noexcept {
    return spot_radius > 0.0 || thickness > 0.0 || absorption > 0.0;
  }
  bool operator==(const UncertaintySettings&) const = default;
};

/// When a treatment is over; run.duration is the longest it may last.
enum class Goal {
  kDuration,  ///< run.duration
  kHold,      ///< the estimated peak was at 95 % of the reference or above for run.hold
  kDose,      ///< the Arrhenius integral at the estimated peak has reached run.dose
};

struct RunSettings {
  double duration = 0.25;  ///< s, above 0, at most 60; at least one control period
  Goal goal = Goal::kDuration;
  double hold = 0.1;       ///< s, above 0, at most 60
  double dose = 1.0;       ///< Arrhenius integral (schlott_2012), above 0, at most 1e6
  std::uint64_t seed = 1;  ///< 0 to 2^63 - 1
  bool operator==(const RunSettings&) const = default;
};

struct Config {
  ControlSettings control;
  EstimatorSettings estimator;
  SafetySettings safety;
  ModelSettings model;
  GridSettings grid;
  Tissue tissue;
  UncertaintySettings uncertainty;
  Prior prior;
  PlantSettings plant;
  PhotoacousticSettings photoacoustics;
  RunSettings run;
  bool operator==(const Config&) const = default;

  /// Number of control cycles: duration / period, rounded to the nearest, at least 1.
  std::size_t cycles() const noexcept;
  /// True if the prior is used: by estimator.kind or control.robust.
  bool uses_prior() const noexcept;
  /// Throws Error naming the key, the value and what is accepted.
  void validate() const;
};

/// Reads a configuration, applies `overrides` ("key=value", later ones win) and validates all of
/// it.
///
/// `file`: a TOML file; empty means the defaults. An override's value is TOML, else a bare string;
/// layers are addressed by name: "tissue.layers.RPE.thickness_um=5".
/// A relative model.file is relative to the folder of `file`, in an override to the current one.
/// [plant.tissue] is applied after all of [tissue], whatever their order. Tests: tests/config.
/// Throws Error naming the file and line (or "--set key=value"), the key, the value found and what
/// is accepted. For an unknown key the error suggests the nearest known one.
Config load_config(const std::string& file, const std::vector<std::string>& overrides);

/// The complete configuration as annotated TOML: load_config() of this text gives `config` again.
/// No dates and nothing machine-dependent: the same configuration gives the same text.
std::string to_toml(const Config& config);

/// SHA-256 of to_toml(config), lower-case hexadecimal.
std::string config_sha256(const Config& config);

}  // namespace photocoag
