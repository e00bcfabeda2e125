// Role: online; one cycle's record. Used by loop (writes it), log and run. Units: SI.
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
  Outputs truth;          ///< K; NaN: unknown to the device
  double measured = 0.0;  ///< K; NaN: no sample
  Estimate estimate;
  Decision decision;                            ///< the controller's command
  SampleVerdict sample;                         ///< the supervisor's verdict on this cycle's sample
  Authorization authorization;                  ///< what the supervisor let through for this cycle
  SafetyState safety = SafetyState::kTreating;  ///< at the end of the cycle
  bool overrun = false;  ///< the controller missed this period: no new power was written
  /// W, in force during the cycle as reported by the device; NaN: not reported.
  double device_command = std::numeric_limits<double>::quiet_NaN();
};

/// Further data at the end of a cycle.
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
