// Role: online; decides each cycle which power may be written to the laser, and latches. Used by
// loop, run, fmu. States and gate are here, the checks in device_check, clock_check, power_check,
// sample_check, estimate_check and dose_check. Source: docs/safety.md (states, checks, fallback).
// Shares no code and no state with estimator and optimisation: it gets their results as plain
// numbers (ControllerReport) and checks them against the device's data and the observer. Units: SI.
// Real time: noexcept, bounded, allocation-free from the first call. Threads: one owner.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "photocoag/device/device.hpp"
#include "photocoag/safety/clock_check.hpp"
#include "photocoag/safety/controller_report.hpp"
#include "photocoag/safety/dose_check.hpp"
#include "photocoag/safety/estimate_check.hpp"
#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/multi_model_observer.hpp"
#include "photocoag/safety/power_check.hpp"
#include "photocoag/safety/sample_check.hpp"
#include "photocoag/safety/status.hpp"

namespace photocoag {

/// The supervisor's verdict on a sample.
struct SampleVerdict {
  bool usable = false;                        ///< may enter the estimator
  SafetyReason reason = SafetyReason::kNone;  ///< why not
  double power = 0.0;                         ///< W, best estimate of the emitted power
};

/// The power that may be written.
struct Authorization {
  double power = 0.0;                         ///< W
  SafetyReason reason = SafetyReason::kNone;  ///< why it differs from the command; or a detection
                                              ///< without effect on it
  bool open_interlock = false;                ///< 0 W by software alone is not trusted
};

struct SelfTestReport {
  int samples = 0;                ///< of the baseline at 0 W
  double mean = 0.0;              ///< K
  double sigma = 0.0;             ///< K
  double power_at_zero = 0.0;     ///< W read back with 0 W commanded
  bool interlock_closed = false;  ///< as the device said last, like the next two
  bool shutter_open = false;
  bool foot_switch = false;
  bool watchdog_tripped = false;  ///< the device fell to 0 W without a fresh token
  bool model_matches = false;     ///< the model's period and tissue are those of the run
  bool solver_exact = false;      ///< a stored problem solved to 1e-9
  bool log_has_room = false;

  /// Without these a device may not be asked for light.
  bool switches_ready() const noexcept { return interlock_closed && shutter_open && foot_switch; }
};

/// Accepted results of a self-test with `samples` samples.
struct SelfTestBounds {
  static constexpr int kSamples = 32;  ///< at least
  double mean = 0.0;                   ///< K, at most, either sign
  double sigma_low = 0.0;              ///< K
  double sigma_high = 0.0;             ///< K
};
SelfTestBounds self_test_bounds(const SafetyLimits& limits, int samples) noexcept;

/// One treatment: power_on, finish_self_test, ready, begin, then each cycle check and authorize.
class Supervisor {
 public:
  Supervisor(const SafetyLimits& limits, const ObserverModel& model) noexcept;

  void power_on() noexcept;                                      ///< OFF to SELFTEST
  bool finish_self_test(const SelfTestReport& report) noexcept;  ///< to STANDBY, or SAFE_STOP
  bool ready() noexcept;                                         ///< STANDBY to READY
  bool begin(bool foot_switch) noexcept;                         ///< READY to TREATING
  void reset() noexcept;   ///< by the operator: DONE or SAFE_STOP to SELFTEST; counters are reset
  void finish() noexcept;  ///< the planned end: TREATING to DONE

  /// Call first in a cycle, with everything the device delivered for the period that has ended.
  SampleVerdict check(const DeviceSample& sample, const Readback& readback,
                      DeviceStatus last_write) noexcept;
  /// Call last before the write. Without a check() before it: the first command of a treatment.
  Authorization authorize(const ControllerReport& report) noexcept;

  const SafetyStatus& status() const noexcept { return latch_.status; }
  const MultiModelObserver& observer() const noexcept { return observer_; }
  GuardedLimits& limits_memory() noexcept { return limits_; }

 private:
  Authorization choose(const ControllerReport& report) noexcept;
  double fallback(SafetyReason reason) noexcept;

  /// State of one treatment; replaced by reset().
  struct Memory {
    DoseCheck dose;
    PowerCheck power;
    ClockCheck clock;
    SampleCheck sample;
    EstimateCheck estimate;
    std::int64_t cycles = 0;   // checked
    bool fresh_sample = true;  // this cycle's sample was usable
    int infeasible = 0;        // in a row
    int fallbacks = 0;         // in a row
    std::array<double, 2> plan{std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::quiet_NaN()};  // W, the last good one
  };

  GuardedLimits limits_;
  ObserverModel model_;
  MultiModelObserver observer_;
  SafetyLatch latch_;
  Memory memory_;
};

}  // namespace photocoag
