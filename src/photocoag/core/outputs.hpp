// Role: offline and online; the two outputs of every model.
#pragma once

namespace photocoag {

/// Temperature rises over ambient, K.
struct Outputs {
  double volume = 0.0;  ///< absorption-weighted mean over depth and spot: what is measured
  double peak = 0.0;    ///< on the axis at mid-depth of the peak layer: what is controlled
};

/// True from 95 % of the reference on: the one definition behind "time to 95 %", goals and
/// verdicts.
constexpr bool reached(double peak, double reference) noexcept { return peak >= 0.95 * reference; }

}  // namespace photocoag
