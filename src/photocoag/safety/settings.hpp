// Role: setup; what a user may choose of the supervisor. Used by the configuration.
// Source: docs/safety.md. Units: SI.
#pragma once

namespace photocoag {

struct SafetySettings {
  bool supervised = true;       ///< false: nothing but the controller's own gate (the paper)
  double power_rise_max = 0.1;  ///< W, largest rise from one period to the next; above 0, at most 1
  double energy_max = 6.0;      ///< J, emitted in one treatment; above 0, at most 60
  double exposure_max = 60.0;   ///< s, with light; above 0, at most 60
  double thermal_dose_max =
      0.0;  ///< Arrhenius integral (schlott_2012), 0: not limited; at most 1e6
  int overruns_in_a_row_max = 1;     ///< one more stops; 0 to 1000
  int overruns_per_hundred_max = 1;  ///< one more stops; 0 to 100
  bool operator==(const SafetySettings&) const = default;
};

}  // namespace photocoag
