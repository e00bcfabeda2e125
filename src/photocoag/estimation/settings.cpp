#include "photocoag/estimation/settings.hpp"

#include <fmt/format.h>

#include "photocoag/core/check.hpp"
#include "photocoag/core/setting.hpp"

namespace photocoag {

std::vector<Field> fields_of(EstimatorSettings& s) {
  using namespace units;
  FieldTable table("estimator");
  table.word("kind", s.kind, {"ekf", "mhe", "posterior"},
             "extended Kalman filter or moving horizon estimator, for temperature and alpha; "
             "posterior: all quantities of [[prior]] from all samples");
  table.integer("window", s.window, 2, kMaxWindow, "control samples in the moving horizon");
  table.number("absorption_initial", s.absorption_initial, kOne, {0.05, 5},
               "alpha before the first sample, from absorption_min to absorption_max");
  table.number("absorption_sigma_initial", s.absorption_sigma_initial, kOne, {0, 2, true},
               "its standard deviation");
  table.number("absorption_min", s.absorption_min, kOne, {0.05, 5}, "alpha is kept at or above");
  table.number("absorption_max", s.absorption_max, kOne, {0.05, 5}, "alpha is kept at or below");
  table.number("absorption_process_noise", s.absorption_process_noise, kOne, {0, 0.1},
               "standard deviation (variance: its square) added to alpha per control sample");
  table.number("power_process_noise_W", s.power_process_noise, kWatt, {0, 0.01},
               "standard deviation per control sample of an unknown power that enters as the "
               "laser does; stands for model error");
  table.number("measurement_noise_K", s.measurement_noise, kKelvin, {0, 20, true},
               "standard deviation of the volume temperature, as configured below, per control "
               "sample");
  table.number("outlier_sigma", s.outlier_sigma, kOne, {0, 100},
               "a sample this many standard deviations from its prediction is rejected, and the "
               "gate doubles with each; 0: never, else from 3");
  table.word("unknowns", s.unknowns, {"rpe", "rpe-and-choroid"},
             "alpha, or alpha and beta, which needs a layer with scaled_by = \"beta\"");
  table.number("choroid_initial", s.choroid_initial, kOne, {0.05, 20},
               "beta before the first sample; its constant value if not estimated");
  table.number("choroid_sigma_initial", s.choroid_sigma_initial, kOne, {0, 2, true},
               "its standard deviation");
  table.number("choroid_min", s.choroid_min, kOne, {0.05, 20}, "beta is kept at or above");
  table.number("choroid_max", s.choroid_max, kOne, {0.05, 20}, "beta is kept at or below");
  table.number("choroid_process_noise", s.choroid_process_noise, kOne, {0, 0.1},
               "standard deviation added to beta per control sample");
  table.number(
      "sample_averaging_periods", s.timing.averaging, kPeriods, {0, 1},
      "the estimator's samples: means over this part of a period; with the two lags at most 1");
  table.number("sample_lag_periods", s.timing.sample_lag, kPeriods, {0, 1},
               "the estimator's samples: taken this long before the period's end");
  table.number("power_lag_periods", s.timing.power_lag, kPeriods, {0, 1},
               "the estimator's power: takes effect this much later");
  return table.take();
}

void EstimatorSettings::validate() const {
  EstimatorSettings own = *this;
  require_in_range(fields_of(own));
  require(absorption_min < absorption_max, "estimator.absorption_max", absorption_max,
          fmt::format("above estimator.absorption_min = {}", absorption_min));
  require(absorption_initial >= absorption_min && absorption_initial <= absorption_max,
          "estimator.absorption_initial", absorption_initial,
          fmt::format("from estimator.absorption_min = {} to estimator.absorption_max = {}",
                      absorption_min, absorption_max));
  require(choroid_min < choroid_max, "estimator.choroid_max", choroid_max,
          fmt::format("above estimator.choroid_min = {}", choroid_min));
  require(choroid_initial >= choroid_min && choroid_initial <= choroid_max,
          "estimator.choroid_initial", choroid_initial,
          fmt::format("from estimator.choroid_min = {} to estimator.choroid_max = {}", choroid_min,
                      choroid_max));
  const double whole = timing.averaging + timing.sample_lag + timing.power_lag;
  require(whole <= 1.0, "estimator.sample_lag_periods", timing.sample_lag,
          fmt::format("with sample_averaging_periods = {} and power_lag_periods = {} at most 1 in "
                      "sum; control.delay_cycles is a whole period",
                      timing.averaging, timing.power_lag));
  if (outlier_sigma != 0.0) {
    require(outlier_sigma >= 3.0, "estimator.outlier_sigma", outlier_sigma,
            "0, which means never, or a number from 3 to 100");
  }
}

}  // namespace photocoag
