#include "photocoag/mpc/settings.hpp"

#include <fmt/format.h>

#include "photocoag/core/check.hpp"

namespace photocoag {

void ControlSettings::validate() const {
  require_between(period * 1e3, 0.05, 100.0, "control.period_ms");
  require(horizon >= 2 && horizon <= 50, "control.horizon", horizon, "an integer from 2 to 50");
  require_positive(peak_reference, 150.0, "control.peak_reference_K");
  require_positive(peak_max, 150.0, "control.peak_max_K");
  require(peak_reference < peak_max, "control.peak_reference_K", peak_reference,
          fmt::format("below the limit control.peak_max_K = {} K", peak_max));
  require(power_max > 0.0 && power_max <= 1.0, "control.power_max_W", power_max,
          "a power in watts above 0, at most 1 (0.1 W is 100 mW)");
  require_between(power_min, 0.0, 1.0, "control.power_min_W");
  require(power_min < power_max, "control.power_min_W", power_min,
          fmt::format("from 0 to below control.power_max_W = {} W", power_max));
  require_between(power_weight, 0.0, 1e9, "control.power_weight");
  require_between(power_change_weight, 0.0, 1e9, "control.power_change_weight");
  require_between(osqp_tolerance, 1e-6, 0.1, "control.osqp_tolerance");
  if (state_weight == StateWeight::kDelayed) {
    // The first inputs are then scored by R1 and R2 alone: without them u0 is not unique. Below the
    // floor it is unique on paper only (the outputs' own scale is some 100 K2).
    const double floor = 1e-6 / (power_max * power_max);
    require(power_weight + power_change_weight >= floor, "control.state_weight",
            std::string_view("delayed with power_weight + power_change_weight too small"),
            fmt::format("delayed with power_weight + power_change_weight of at least {:g} K2/W2",
                        floor));
  }
}

}  // namespace photocoag
