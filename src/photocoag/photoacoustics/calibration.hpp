// Role: setup; fits a calibration curve to data of tissue at known temperatures. Used by
// `calibrate`. Source: docs/photoacoustics.md, "Calibration". Units: deg C, J; amplitudes in
// arbitrary units.
#pragma once

#include <vector>

#include "photocoag/photoacoustics/curve.hpp"

namespace photocoag {

/// One pulse on tissue of uniform temperature.
struct CalibrationPoint {
  double celsius = 0.0;
  double amplitude = 0.0;
  double energy = 0.0;  ///< J
};

struct CalibrationBin {
  double from_celsius = 0.0;
  double to_celsius = 0.0;
  std::size_t points = 0;
  double mean = 0.0;   ///< K, of measured minus true temperature
  double sigma = 0.0;  ///< K
};

struct Calibration {
  CurveData curve;  ///< relative to 1 in the middle of the data
  int degree = 0;
  std::vector<double>
      left_out;  ///< relative cross-validation error (leave-one-out), degree 1, 2, …
  double residual_relative = 0.0;  ///< rms of amplitude / energy against the curve
  double residual = 0.0;           ///< rms, K
  double residual_max = 0.0;       ///< K
  std::vector<CalibrationBin> bins;
};

/// Least squares in amplitude / energy, relative to the value. `degree` 0: the smallest of 1 to 3
/// whose leave-one-out error is within 2 % of the best. Throws Error if there are fewer than 8
/// points or less than 5 K between them, a point is not finite and positive, or the fitted curve
/// does not rise.
Calibration fit_calibration(const std::vector<CalibrationPoint>& points, int degree);

}  // namespace photocoag
