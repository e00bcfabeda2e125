// Role: offline and online; the two outputs of every model.
#pragma once

namespace photocoag {

/// Temperature rises over ambient, K.
struct Outputs {
  double volume = 0.0;  ///< depth-weighted mean over the spot: what is measured
  double peak = 0.0;    ///< on the axis at mid-depth of the peak layer: what matters
};

/// True from 95 % of the reference on: what "time to 95 %", goals and verdicts mean.
constexpr bool reached(double peak, double reference) noexcept { return peak >= 0.95 * reference; }

}  // namespace photocoag
