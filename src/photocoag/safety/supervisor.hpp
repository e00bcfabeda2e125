// Role: online; decides each cycle what may be written to the laser, and latches. Used by loop.
// Source: docs/safety.md (states, checks, fallback). Shares no code and no state with estimator and
// optimisation: it sees their answers as plain numbers (ControllerReport) and judges them by the
// device's own data and the witness. Units: SI.
// Real time: noexcept, bounded, allocation-free from the first call. Threads: one owner.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "photocoag/device/device.hpp"
#include "photocoag/safety/limits.hpp"
#include "photocoag/safety/states.hpp"
#include "photocoag/safety/witness.hpp"

namespace photocoag {

enum class SolveOutcome : std::uint8_t { kSolved, kInfeasible, kFailed };

/// What the controller says in one cycle.
struct ControllerReport {
  double command = 0.0;  ///< W
  SolveOutcome solve = SolveOutcome::kSolved;
  bool restarted = false;         ///< the estimator went back to its initial values
  bool updated = false;           ///< the estimator used this cycle's sample
  double peak = 0.0;              ///< K, estimate
  double absorption = 0.0;        ///< estimate
  double innovation = 0.0;        ///< K
  double innovation_sigma = 0.0;  ///< K
  /// W, what the same plan would write next and after that; not finite: nothing planned.
  std::array<double, 2> plan{std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN()};
};

/// What the supervisor makes of a sample.
struct SampleVerdict {
  bool usable = false;                        ///< may enter the estimator
  SafetyReason reason = SafetyReason::kNone;  ///< why not
  double power = 0.0;                         ///< W, best knowledge of what was emitted
};

/// What may be written.
struct Authorization {
  double power = 0.0;                         ///< W
  SafetyReason reason = SafetyReason::kNone;  ///< why it differs from the command, or noted
  bool open_interlock = false;                ///< 0 W by software alone is not trusted
};

struct SelfTestReport {
  int samples = 0;                ///< of the baseline at 0 W
  double mean = 0.0;              ///< K
  double sigma = 0.0;             ///< K
  double power_at_zero = 0.0;     ///< W read back with 0 W commanded
  bool watchdog_tripped = false;  ///< the device fell to 0 W without a fresh token
  bool model_matches = false;     ///< period and tissue of the model are those of the run
  bool solver_exact = false;      ///< a canned problem solved to 1e-9
  bool log_has_room = false;
};

/// What a self-test with so many samples may show.
struct SelfTestBounds {
  static constexpr int kSamples = 32;  ///< at least
  double mean = 0.0;                   ///< K, at most, either sign
  double sigma_low = 0.0;              ///< K
  double sigma_high = 0.0;             ///< K
};
SelfTestBounds self_test_bounds(const SafetyLimits& limits, int samples) noexcept;

struct SafetyStatus {
  SafetyState state = SafetyState::kOff;
  SafetyReason reason = SafetyReason::kNone;  ///< of the state, if DONE, SAFE_STOP or STANDBY
  std::int64_t detections = 0;  ///< bad samples, rejected commands, overruns: all that was noticed
  SafetyReason last_detection = SafetyReason::kNone;
  std::int64_t late_commands = 0;  ///< periods in which the device had an older one in force
  double energy = 0.0;             ///< J emitted
  double exposure = 0.0;           ///< s with light
  double dose = 0.0;               ///< Arrhenius integral at the largest plausible absorption
};

/// One treatment: power_on, finish_self_test, ready, begin, then each cycle check and authorize.
class Supervisor {
 public:
  Supervisor(const SafetyLimits& limits, const WitnessModel& model) noexcept;

  void power_on() noexcept;                                      ///< OFF to SELFTEST
  bool finish_self_test(const SelfTestReport& report) noexcept;  ///< to STANDBY, or SAFE_STOP
  bool ready() noexcept;                                         ///< STANDBY to READY
  bool begin(bool foot_switch) noexcept;                         ///< READY to TREATING
  void reset() noexcept;   ///< by the operator: DONE or SAFE_STOP to SELFTEST; counters start anew
  void finish() noexcept;  ///< the planned end: TREATING to DONE

  /// First thing of a cycle: everything the device delivered for the period that has ended.
  SampleVerdict check(const DeviceSample& sample, const Readback& readback,
                      DeviceStatus last_write) noexcept;
  /// Last thing before the write. Without a check() before it: the very first command.
  Authorization authorize(const ControllerReport& report) noexcept;

  const SafetyStatus& status() const noexcept { return status_; }
  const Witness& witness() const noexcept { return witness_; }
  GuardedLimits& limits_memory() noexcept { return limits_; }

 private:
  void stop(SafetyState state, SafetyReason reason, bool open_interlock = false) noexcept;
  void notice(SafetyReason reason) noexcept;
  void check_device(const DeviceSample& sample, const Readback& readback,
                    DeviceStatus last_write) noexcept;
  /// What the device says was in force, next to what should have been.
  enum class InForce : std::uint8_t { kUnknown, kAsWritten, kLate, kForeign };
  InForce judge_command(double command) const noexcept;
  void check_readback(const Readback& readback, InForce command) noexcept;
  void judge_excess(const Readback& readback, bool power_known) noexcept;
  void check_clock(const DeviceSample& sample, InForce command) noexcept;
  double wanted() const noexcept;
  double on_its_way() const noexcept;
  double hidden_gain() const noexcept;
  void account(double power) noexcept;
  SafetyReason judge(const DeviceSample& sample) noexcept;
  void count_bad(SafetyReason reason) noexcept;
  void watch_noise(double residual) noexcept;
  void check_estimate(const ControllerReport& report) noexcept;
  Authorization choose(const ControllerReport& report) noexcept;
  double fallback(SafetyReason reason) noexcept;
  void remember(double power) noexcept;

  /// Sum over the last 20 values, and how many there were.
  class Window {
   public:
    void add(double value) noexcept;
    double sum() const noexcept;
    bool full() const noexcept { return count_ >= kLength; }

   private:
    static constexpr int kLength = 20;
    double values_[kLength]{};
    std::int64_t count_ = 0;
  };

  /// One bit per cycle, newest first: counts events among the last 128 cycles.
  class History {
   public:
    void add(bool event) noexcept;
    int among_last(int cycles) const noexcept;

   private:
    std::uint64_t recent_ = 0;
    std::uint64_t older_ = 0;
  };

  struct Memory {
    bool open_interlock = false;
    bool fresh_sample = true;      // this cycle's sample was usable
    std::int64_t unwritten = 0;    // so many readbacks come of a period without a write of ours
    double written = 0.0;          // W, last power authorized
    double written_before = 0.0;   // W, the one before
    double written_earlier = 0.0;  // W, and the one before that
    double peak_high = 0.0;        // K, at the last cycle
    std::uint64_t expected = 0;    // least sequence number of this cycle's sample
    std::int64_t raw = std::numeric_limits<std::int64_t>::min();
    int same_raw = 0;
    int missing = 0;
    int saturated = 0;
    int overruns = 0;
    int readback_off = 0;
    int late_commands = 0;  // in a row
    int fallbacks = 0;
    std::array<double, 2> plan{std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::quiet_NaN()};  // W, the last good one
    int infeasible = 0;
    int restarts = 0;
    int absorption_bad = 0;
    int peak_high_estimates = 0;
    std::int64_t cycles = 0;
    double absorption = 0.0;
    double settling = 0.0;  // square of what the estimate has lately moved, relative
    History rejected;
    History overrun_history;
    Window residuals;
    Window innovations;  // K^2, squared
    Window excess;       // relative to the largest variance that may be expected
  };

  GuardedLimits limits_;
  WitnessModel model_;
  Witness witness_;
  SafetyStatus status_;
  Memory memory_;
};

}  // namespace photocoag
