// Role: online; one cycle's record. Used by loop (writes it) and run (prints it). Units: SI.
#pragma once

#include <cstdint>
#include <limits>

#include "photocoag/device/device.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

/// Row k: `time` is the end of cycle k; `power` was applied during it; temperatures at its end; the
/// estimate after the update with its sample; decision fields of the solve that chose its power.
struct CycleRecord {
  std::int64_t cycle = 0;
  double time = 0.0;      ///< s
  double power = 0.0;     ///< W
  Outputs truth;          ///< K; NaN: the device does not tell
  double measured = 0.0;  ///< K; NaN: no sample
  Estimate estimate;
  Decision decision;                            ///< what the controller wanted
  SampleVerdict sample;                         ///< the supervisor's, of this cycle's sample
  Authorization authorization;                  ///< what it let through for this cycle
  SafetyState safety = SafetyState::kTreating;  ///< at the end of the cycle
  bool overrun = false;  ///< the controller missed this period: the laser ran on its own
  /// W, in force during the cycle as the device says; NaN: it does not.
  double device_command = std::numeric_limits<double>::quiet_NaN();
};

/// What else the end of a cycle brought.
struct CycleEnd {
  DeviceSample sample;
  Readback readback;
  double next_power = 0.0;  ///< W, written for the coming period; NaN: nothing
  double volume_predicted = std::numeric_limits<double>::quiet_NaN();  ///< K, before the update
  /// K, standard deviation expected of measured - predicted; NaN: no update.
  double innovation_sigma = std::numeric_limits<double>::quiet_NaN();
  SafetyStatus safety;
};

}  // namespace photocoag
