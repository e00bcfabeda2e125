// Role: studies; what a treatment held, beside the numbers of its summary (run/run_folder.hpp).
// Used by population/spots, campaign. Units: SI.
#pragma once

#include <limits>

#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// Of the cycles that end after some time; NaN if there are none, or the treatment was stopped.
struct Held {
  double error = std::numeric_limits<double>::quiet_NaN();         ///< K, mean of peak - reference
  double deviation = std::numeric_limits<double>::quiet_NaN();     ///< K, of the true peak
  double estimate_rms = std::numeric_limits<double>::quiet_NaN();  ///< K, of estimated - true peak
};

/// `after`: s. `reference`: K.
Held held(const Treatment& treatment, double after, double reference);

}  // namespace photocoag
