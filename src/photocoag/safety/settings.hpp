// Role: setup; the user's settings of the supervisor. Used by the configuration.
// Source: docs/safety.md. Units: SI.
#pragma once

namespace photocoag {

enum class RealTimeMode {
  kObserve,  ///< runs with whatever scheduling it gets; for simulated devices only
  kEnforce,  ///< refuses to treat without SCHED_FIFO and locked memory
};

struct SafetySettings {
  bool supervised = true;       ///< false: only the controller's own gate, as in the paper
  double power_rise_max = 0.1;  ///< W, largest rise from one period to the next; above 0, at most 1
  double energy_max = 6.0;      ///< J, emitted in one treatment; above 0, at most 60
  double exposure_max = 60.0;   ///< s, with light; above 0, at most 60
  double thermal_dose_max =
      0.0;                      ///< Arrhenius integral (schlott_2012), 0: not limited; at most 1e6
  double power_accuracy = 0.0;  ///< relative, of power and readback together; at most 0.5
  double sample_gain_accuracy = 0.0;  ///< relative, of the thermometer's calibration; at most 0.5
  RealTimeMode real_time = RealTimeMode::kObserve;
  int core = -1;  ///< core to which the loop's thread is pinned; -1: none
  bool operator==(const SafetySettings&) const = default;
};

}  // namespace photocoag
