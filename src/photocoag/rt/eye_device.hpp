// Role: online; the simulated eye of another process as a Device: pulses in, one control sample per
// period out. Used by run, tests. Source: docs/devices.md, docs/photoacoustics.md. Units: SI.
// Real time: the calls of the loop are noexcept, bounded and allocation-free; wait_sample blocks by
// design. Threads: one owner.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/core/outputs.hpp"
#include "photocoag/device/device.hpp"
#include "photocoag/photoacoustics/thermometer.hpp"
#include "photocoag/rt/eye_link.hpp"

namespace photocoag {

struct EyeLinkSettings {
  std::string socket;  ///< path
  EyeTransport transport = EyeTransport::kSharedMemory;
  double period = 1e-3;   ///< s, control
  int delay = 0;          ///< periods from a sample to the power computed from it
  double patience = 1.5;  ///< control periods that a sample may be late before it is missing
  /// s of wall time that an eye in lockstep may need for a period before its sample is missing
  double lockstep_patience = 10.0;
};

/// The truth of one control period, for evaluation only.
struct PeriodTruth {
  Outputs outputs;          ///< K, means over the last pulse period
  double peak_pulse = 0.0;  ///< K, highest instant after a pulse
};

class EyeDevice {
 public:
  /// Connects. Throws Error if there is no eye, it has another controller, or the control period is
  /// no whole number of its pulse periods.
  explicit EyeDevice(const EyeLinkSettings& settings);
  ~EyeDevice();
  EyeDevice(const EyeDevice&) = delete;
  EyeDevice& operator=(const EyeDevice&) = delete;

  int pulses_per_period() const noexcept { return static_cast<int>(per_period_); }
  /// What the eye has said of itself.
  const EyeWelcome& welcome() const noexcept { return link_.welcome(); }
  /// From now on the eye makes a period's pulses when its sample is waited for, however long the
  /// controller took; time stamps are of the eye's virtual clock. Before prepare or between two
  /// treatments. Throws Error if the eye does not agree.
  void follow_in_lockstep();
  bool in_lockstep() const noexcept { return lockstep_; }
  /// Collects pulses of the cold eye at 0 W and makes the thermometer. Throws Error. Allocates.
  Baseline prepare(const GrueneisenCurve& curve, const ThermometerSettings& settings, int pulses);
  /// The next control period is cycle 0. Blocks until the one before it ends. Allocates: the truth
  /// of `cycles` periods is kept; with 0 it is a self-test, no treatment.
  void begin(std::size_t cycles);

  DeviceSample wait_sample(std::uint64_t cycle) noexcept;
  Readback readback() noexcept { return readback_; }
  DeviceStatus write_power(double power, std::uint64_t token) noexcept;
  void heartbeat(std::uint64_t) noexcept {}
  void safe_off() noexcept;

  /// Of the sample fetched last: what the thermometer says about its pulses.
  const ThermometerSample& last_sample() const noexcept { return last_; }
  /// After the loop: one entry per finished period.
  const std::vector<PeriodTruth>& finish_truth() noexcept;
  std::uint64_t late_pulses() const noexcept { return late_; }
  /// Share of the baseline's pulses that eye or controller were late for.
  double late_in_baseline() const noexcept { return late_in_baseline_; }

 private:
  bool wait_for(std::uint64_t pulses, std::int64_t patience_ns) noexcept;
  bool wait_for_granted(std::uint64_t pulses) noexcept;
  void read_period(std::uint64_t first) noexcept;
  std::uint64_t periods_too_late(std::int64_t age_ns) const noexcept;
  void keep_truth(std::uint64_t period) noexcept;
  std::int64_t due_ns(std::uint64_t pulse) const noexcept;

  EyeLinkSettings settings_;
  EyeLink link_;
  std::int64_t pulse_ns_;
  std::uint64_t per_period_;
  bool lockstep_ = false;
  std::uint64_t first_ = 0;      // period of cycle 0
  std::uint64_t delivered_ = 0;  // cycles
  std::uint64_t written_ = 0;    // commands
  std::uint64_t seen_before_ = 0;
  std::uint64_t late_ = 0;
  double late_in_baseline_ = 0.0;
  std::int64_t raw_ = 0;
  bool refused_ = false;  // the eye would not emit what was ordered
  std::optional<PulseThermometer> thermometer_;
  double hottest_ = 0.0;  // K, what the curve can tell
  ThermometerSample last_;
  Readback readback_;
  std::vector<PeriodTruth> truth_;
};
static_assert(Device<EyeDevice>);

}  // namespace photocoag
