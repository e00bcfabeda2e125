// Role: online; the supervisor's check of the power: the command in force and the power emitted, as
// reported by the device, against what was written. Used by the supervisor, run, console. Rows of
// the fault table (docs/safety.md): A1, A2; late commands: T1, T2. Units: W. Real time: noexcept,
// bounded, allocation-free.
#pragma once

#include <cstdint>

#include "photocoag/device/device.hpp"
#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/multi_model_observer.hpp"
#include "photocoag/safety/status.hpp"

namespace photocoag {

inline constexpr double kReadbackRelative = 0.2;  ///< of the power
inline constexpr double kReadbackFloor = 2e-3;    ///< W
inline constexpr int kReadbackOffMax = 1;         ///< in a row

/// The command that the device reports, compared with the one written.
enum class InForce : std::uint8_t { kUnknown, kAsWritten, kLate, kForeign };

class PowerCheck {
 public:
  /// Call first in a cycle. `command`: W, Readback::command.
  InForce in_force(double command, const SafetyLimits& limits) const noexcept;
  /// `sample`: of the period that `readback` is of. Without it no power may be known: the stop is
  /// the same, its reason kSampleMissing.
  void check(const Readback& readback, InForce command, DeviceStatus sample,
             const SafetyLimits& limits, SafetyLatch& latch) noexcept;
  /// W, best estimate of the power emitted in the period that has ended.
  double emitted(const Readback& readback, const SafetyLimits& limits) const noexcept;
  /// A power other than the one commanded is tolerated for a second period, unless that would
  /// overheat.
  void check_excess(const Readback& readback, const MultiModelObserver& observer,
                    const SafetyLimits& limits, SafetyLatch& latch) const noexcept;
  /// `behind`: the period's sample came too late, so the write after it was missed.
  void end_period(bool behind, const SafetyLimits& limits) noexcept;

  void write(double power) noexcept;  ///< W, authorized for the next period
  double written() const noexcept { return written_; }
  /// J, written but not yet emitted.
  double on_its_way(const SafetyLimits& limits) const noexcept;

 private:
  bool known(const Readback& readback, const SafetyLimits& limits) const noexcept;
  double wanted(const SafetyLimits& limits) const noexcept;

  double written_ = 0.0;          // W, last power authorized
  double written_before_ = 0.0;   // the one before
  double written_earlier_ = 0.0;  // and the one before that
  int readback_off_ = 0;          // in a row
  std::int64_t unwritten_ = 0;  // number of coming readbacks that belong to periods without a write
};

}  // namespace photocoag
