// Role: online; the supervisor's states and reasons. Used by safety, loop, run, report, console,
// fault_table.
// Source: docs/safety.md.
#pragma once

#include <cstdint>
#include <string_view>

namespace photocoag {

enum class SafetyState : std::uint8_t {
  kOff,
  kSelfTest,
  kStandby,   ///< self-test passed
  kReady,     ///< armed; the foot switch starts
  kTreating,  ///< the only state in which a power above 0 W can be written
  kDone,      ///< a limit of dose, energy or time was reached, or the planned end
  kSafeStop,  ///< latched: only reset() and a passed self-test lead out of it
};

/// Why the supervisor acted. In brackets: the row of the fault table (docs/safety.md).
enum class SafetyReason : std::uint8_t {
  kNone,
  kSampleMissing,     ///< [M1, M2, M5]
  kSampleStale,       ///< [M3, M9] old, repeated, out of order or from the future
  kSampleStuck,       ///< [M4]
  kSampleSaturated,   ///< [M6]
  kSampleRejected,    ///< [M7] inconsistent with the emitted power
  kMeasurementNoise,  ///< [M8] residuals do not fit the calibrated noise
  kPowerReadback,     ///< [A1]
  kPowerStuckOn,      ///< [A2]
  kWriteFailed,       ///< [A3]
  kDeviceGone,        ///< [A4]
  kInterlock,         ///< [A5]
  kShutter,           ///< [A5]
  kFootSwitch,        ///< [A5]
  kInfeasible,        ///< [S1]
  kSolverFailed,      ///< [S2]
  kCommandInvalid,    ///< [S3]
  kEstimatorRestart,  ///< [E1]
  kAbsorption,        ///< [E2]
  kInconsistent,      ///< [E3]
  kEstimatedPeak,     ///< [E4]
  kOverrun,           ///< [T1, T2, T3]
  kEnergy,            ///< [X1]
  kExposure,          ///< [X1]
  kThermalDose,       ///< [X1]
  kLimitsCorrupted,   ///< [X4]
  kPeakCeiling,       ///< the command was lowered so that no plausible absorption overheats
  kSlew,              ///< the command was lowered to the largest rise per period
  kCoasting,          ///< the command was lowered: no rise without a fresh sample
  kSelfTest,          ///< a self-test failed
  kNotTreating,       ///< not in TREATING: 0 W
  kCommandLate,       ///< [T1, T2] the device reports that an older command was in force
};

constexpr std::string_view to_string(SafetyState state) noexcept {
  constexpr std::string_view names[] = {"off",      "self_test", "standby",  "ready",
                                        "treating", "done",      "safe_stop"};
  return names[static_cast<std::size_t>(state)];
}

constexpr std::string_view to_string(SafetyReason reason) noexcept {
  constexpr std::string_view names[] = {"none",
                                        "sample_missing",
                                        "sample_stale",
                                        "sample_stuck",
                                        "sample_saturated",
                                        "sample_rejected",
                                        "measurement_noise",
                                        "power_readback",
                                        "power_stuck_on",
                                        "write_failed",
                                        "device_gone",
                                        "interlock",
                                        "shutter",
                                        "foot_switch",
                                        "infeasible",
                                        "solver_failed",
                                        "command_invalid",
                                        "estimator_restart",
                                        "absorption",
                                        "inconsistent",
                                        "estimated_peak",
                                        "overrun",
                                        "energy",
                                        "exposure",
                                        "thermal_dose",
                                        "limits_corrupted",
                                        "peak_ceiling",
                                        "slew",
                                        "coasting",
                                        "self_test",
                                        "not_treating",
                                        "command_late"};
  return names[static_cast<std::size_t>(reason)];
}

}  // namespace photocoag
