// Role: safety tests; which fault occurs when. Used by faults, fault_table. Source: docs/safety.md,
// fault table. Independent of the supervisor.
#pragma once

#include <cstdint>

namespace photocoag {

enum class Fault : std::uint8_t {
  kNone,
  kMissing,       ///< no sample
  kSameSequence,  ///< the previous sample again
  kOld,           ///< two periods old
  kFuture,        ///< a time stamp one hour ahead
  kLateByOne,     ///< each sample comes one period late
  kStuck,         ///< the converter's code freezes
  kNotANumber,
  kInfinite,
  kNegativeZero,
  kDenormal,
  kRail,        ///< converter at its rail
  kSpike,       ///< value is added, K, in every `every`-th cycle
  kNoise,       ///< noise times value
  kBias,        ///< value is added, K
  kGain,        ///< times value
  kReadback,    ///< power readback times value
  kStuckOn,     ///< 0 W commanded, but the laser emits value, W
  kLaser,       ///< the laser emits value times the command, and the readback shows it
  kLaserAt,     ///< the laser emits value, W, whatever the command, and the readback shows it
  kWriteFails,  ///< writes are lost and time out
  kGone,        ///< the device is gone: no sample, writes lost, safe_off lost
  kShutter,
  kInterlock,
  kFootSwitch,
  kInfeasible,    ///< status infeasible, yet a power (value, W)
  kSolverFails,   ///< status failed, yet a power (value, W)
  kCommand,       ///< status solved, the command is value
  kRestart,       ///< the estimator restarts, cold
  kAbsorption,    ///< the estimate of alpha is value; the command full power
  kInnovation,    ///< innovations times value
  kPeakEstimate,  ///< the estimated peak is value, K
  kOverrun,       ///< the wake-up comes `count` periods late
  kTwoOverruns,   ///< two single ones, `every` cycles apart
  kGains,         ///< laser, readback and samples are each off by a factor, at once or in a ramp
  kJump,          ///< alpha becomes value
  kDrift,         ///< alpha grows by value, relative, per ms
  kLag,   ///< samples are delayed or averaged, or powers delayed, from the start of treatment
  kHook,  ///< the trial injects the fault itself, e.g. flips a bit
};

struct Injection {
  Fault fault = Fault::kNone;
  std::uint64_t start = 0;  ///< cycle of the first bad datum
  std::uint64_t count = 1;  ///< cycles
  double value = 0.0;
  std::uint64_t every = 1;
  double laser = 1.0;           ///< kGains: emitted over commanded power
  double readback = 1.0;        ///< kGains: readback over commanded power
  double samples = 1.0;         ///< kGains: sampled over true temperature
  double ramp_ms = 0.0;         ///< kGains: ramp from the start of treatment to the full factors
  double averaging = 0.0;       ///< kLag: of a period, the sample's mean
  double sample_lag = 0.0;      ///< kLag: of a period
  double power_lag = 0.0;       ///< kLag: of a period
  bool emitted_is_read = true;  ///< kLag: the readback is the mean emitted power, else the command

  bool active(std::uint64_t cycle) const noexcept {
    return fault != Fault::kNone && cycle >= start && cycle < start + count &&
           (cycle - start) % every == 0;
  }
};

inline constexpr std::uint64_t kPermanent = std::uint64_t{1} << 40;

}  // namespace photocoag
