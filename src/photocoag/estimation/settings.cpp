#include "photocoag/estimation/settings.hpp"

#include <fmt/format.h>

#include "photocoag/core/check.hpp"

namespace photocoag {

void EstimatorSettings::validate() const {
  require_between(absorption_min, 0.05, 5.0, "estimator.absorption_min");
  require_between(absorption_max, 0.05, 5.0, "estimator.absorption_max");
  require(absorption_min < absorption_max, "estimator.absorption_max", absorption_max,
          fmt::format("above estimator.absorption_min = {}", absorption_min));
  require(absorption_initial >= absorption_min && absorption_initial <= absorption_max,
          "estimator.absorption_initial", absorption_initial,
          fmt::format("from estimator.absorption_min = {} to estimator.absorption_max = {}",
                      absorption_min, absorption_max));
  require_positive(absorption_sigma_initial, 2.0, "estimator.absorption_sigma_initial");
  require_between(absorption_process_noise, 0.0, 0.1, "estimator.absorption_process_noise");
  require_between(power_process_noise, 0.0, 0.01, "estimator.power_process_noise_W");
  require_positive(measurement_noise, 20.0, "estimator.measurement_noise_K");
  require(window >= 2 && window <= kMaxWindow, "estimator.window", window,
          fmt::format("an integer from 2 to {}", kMaxWindow));
  require_between(choroid_min, 0.05, 20.0, "estimator.choroid_min");
  require_between(choroid_max, 0.05, 20.0, "estimator.choroid_max");
  require(choroid_min < choroid_max, "estimator.choroid_max", choroid_max,
          fmt::format("above estimator.choroid_min = {}", choroid_min));
  require(choroid_initial >= choroid_min && choroid_initial <= choroid_max,
          "estimator.choroid_initial", choroid_initial,
          fmt::format("from estimator.choroid_min = {} to estimator.choroid_max = {}", choroid_min,
                      choroid_max));
  require_positive(choroid_sigma_initial, 2.0, "estimator.choroid_sigma_initial");
  require_between(choroid_process_noise, 0.0, 0.1, "estimator.choroid_process_noise");
  require_between(timing.averaging, 0.0, 1.0, "estimator.sample_averaging_periods");
  require_between(timing.sample_lag, 0.0, 1.0, "estimator.sample_lag_periods");
  require_between(timing.power_lag, 0.0, 1.0, "estimator.power_lag_periods");
  const double whole = timing.averaging + timing.sample_lag + timing.power_lag;
  require(whole <= 1.0, "estimator.sample_lag_periods", timing.sample_lag,
          fmt::format("with sample_averaging_periods = {} and power_lag_periods = {} at most 1 in "
                      "sum; control.delay_cycles is a whole period",
                      timing.averaging, timing.power_lag));
  if (outlier_sigma != 0.0) {
    require(outlier_sigma >= 3.0 && outlier_sigma <= 100.0, "estimator.outlier_sigma",
            outlier_sigma, "0, which means never, or a number from 3 to 100");
  }
}

}  // namespace photocoag
