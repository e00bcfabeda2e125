// Role: online; a simulated eye in another process as a Device: pulses in, one control sample per
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
  double patience = 1.5;  ///< control periods a sample may be late before it counts as missing
  /// s of wall time that an eye in lockstep may take per period before its sample counts as missing
  double lockstep_patience = 10.0;
};

/// The truth of one control period, for evaluation only.
struct PeriodTruth {
  Outputs outputs;          ///< K, means over the last pulse period
  double peak_pulse = 0.0;  ///< K, highest value right after a pulse
};

class EyeDevice {
 public:
  /// Connects. Throws Error if there is no eye, it has another controller, or the control period is
  /// not a multiple of its pulse period.
  explicit EyeDevice(const EyeLinkSettings& settings);
  ~EyeDevice();
  EyeDevice(const EyeDevice&) = delete;
  EyeDevice& operator=(const EyeDevice&) = delete;

  int pulses_per_period() const noexcept { return static_cast<int>(per_period_); }
  /// The eye's handshake data.
  const EyeWelcome& welcome() const noexcept { return link_.welcome(); }
  /// Switches to lockstep: the eye fires a period's pulses when its sample is waited for, however
  /// long the controller took; time stamps are those of the eye's virtual clock. Call before
  /// prepare or between treatments. Throws Error if the eye refuses.
  void follow_in_lockstep();
  bool in_lockstep() const noexcept { return lockstep_; }
  /// Collects pulses of the cold eye at 0 W and sets up the thermometer. Throws Error. Allocates.
  Baseline prepare(const GrueneisenCurve& curve, const ThermometerSettings& settings, int pulses);
  /// The next control period is cycle 0. Blocks until the one before it ends. Allocates room for
  /// the truth of `cycles` periods; 0: a self-test, no treatment.
  void begin(std::size_t cycles);

  DeviceSample wait_sample(std::uint64_t cycle) noexcept;
  Readback readback() noexcept { return readback_; }
  DeviceStatus write_power(double power, std::uint64_t token) noexcept;
  void heartbeat(std::uint64_t) noexcept {}
  void safe_off() noexcept;

  /// The thermometer's result for the sample fetched last.
  const ThermometerSample& last_sample() const noexcept { return last_; }
  /// After the loop: one entry per finished period.
  const std::vector<PeriodTruth>& finish_truth() noexcept;
  std::uint64_t late_pulses() const noexcept { return late_; }
  /// Fraction of the baseline's pulses for which eye or controller was late.
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
