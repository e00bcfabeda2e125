// Role: tests of safety; which fault comes when. Used by faults, fault_table. Source:
// docs/safety.md, fault table. Knows nothing of the supervisor.
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
  kStuckOn,     ///< 0 W commanded; the laser emits value, W, all the same
  kLaser,       ///< the laser emits value times what is commanded and says so
  kLaserAt,     ///< the laser emits value, W, whatever is commanded, and says so
  kWriteFails,  ///< writes are lost and time out
  kGone,        ///< the device is gone: no sample, writes lost, safe_off lost
  kShutter,
  kInterlock,
  kFootSwitch,
  kInfeasible,    ///< status infeasible, yet a power (value, W)
  kSolverFails,   ///< status failed, yet a power (value, W)
  kCommand,       ///< status solved, the command is value
  kRestart,       ///< the estimator starts anew, cold
  kAbsorption,    ///< the estimate of alpha is value; the command full power
  kInnovation,    ///< innovations times value
  kPeakEstimate,  ///< the estimated peak is value, K
  kOverrun,       ///< the wake-up comes `count` periods late
  kTwoOverruns,   ///< two single ones, `every` cycles apart
  kGains,         ///< laser, readback and samples are each off by a factor, at once or in a ramp
  kJump,          ///< alpha becomes value
  kDrift,         ///< alpha grows by value, relative, per ms
  kLag,           ///< samples are late or means, or powers act late, from the treatment's start on
  kHook,          ///< the trial does something itself, e.g. flips a bit
};

struct Injection {
  Fault fault = Fault::kNone;
  std::uint64_t start = 0;  ///< cycle of the first bad datum
  std::uint64_t count = 1;  ///< cycles
  double value = 0.0;
  std::uint64_t every = 1;
  double laser = 1.0;       ///< kGains: emitted per commanded power
  double readback = 1.0;    ///< kGains: said per commanded power
  double samples = 1.0;     ///< kGains: said per true temperature
  double ramp_ms = 0.0;     ///< kGains: from the treatment's start until the factors are in full
  double averaging = 0.0;   ///< kLag: of a period, the sample's mean
  double sample_lag = 0.0;  ///< kLag: of a period
  double power_lag = 0.0;   ///< kLag: of a period
  bool emitted_is_read = true;  ///< kLag: the readback is the mean emitted power, else the command

  bool active(std::uint64_t cycle) const noexcept {
    return fault != Fault::kNone && cycle >= start && cycle < start + count &&
           (cycle - start) % every == 0;
  }
};

inline constexpr std::uint64_t kForEver = std::uint64_t{1} << 40;

}  // namespace photocoag
