// Role: setup; calibration curves as TOML files, and heating data as CSV. Used by run, console and
// the commands calibrate, eye. Format: docs/photoacoustics.md.
#pragma once

#include <string>
#include <vector>

#include "photocoag/photoacoustics/calibration.hpp"
#include "photocoag/photoacoustics/curve.hpp"

namespace photocoag {

/// The curve of a TOML file; the water-like one if `file` is empty. Throws Error naming file, line
/// and key.
CurveData load_curve(const std::string& file);
/// load_curve() of this text gives `curve` again.
std::string to_toml(const CurveData& curve);

/// Columns temperature_C, amplitude, energy_uJ, in any order; others are ignored. Throws Error
/// naming file and line.
std::vector<CalibrationPoint> load_heating_data(const std::string& file);

/// Example data for `calibrate --example`: tissue warmed uniformly from 5 K below to 50 K above
/// ambient, measured by the simulated transducer and the matched filter. The same seed gives the
/// same text.
std::string example_heating_data(const CurveData& curve, double ambient_celsius, double noise_K,
                                 int rows, std::uint64_t seed);

}  // namespace photocoag
