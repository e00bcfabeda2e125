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
#include "photocoag/rt/eye_protocol.hpp"

namespace photocoag {

struct EyeLinkSettings {
  std::string socket;  ///< path
  EyeTransport transport = EyeTransport::kSharedMemory;
  double period = 1e-3;   ///< s, control
  int delay = 0;          ///< periods from a sample to the power computed from it
  double patience = 1.5;  ///< control periods that a sample may be late before it is missing
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
  std::uint64_t full_order_states() const noexcept { return states_; }
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

 private:
  bool pump() noexcept;
  bool wait_for(std::uint64_t pulses, std::int64_t deadline_ns) noexcept;
  void read_period(std::uint64_t first) noexcept;
  std::uint64_t periods_too_late(std::int64_t age_ns) const noexcept;
  void keep_truth(std::uint64_t period) noexcept;
  bool record(std::uint64_t number, PulseRecord& out) const noexcept;
  std::int64_t due_ns(std::uint64_t pulse) const noexcept;

  EyeLinkSettings settings_;
  int socket_ = -1;
  EyeSharedMemory* memory_ = nullptr;  // mapped, or our own copy that the socket fills
  std::int64_t start_ns_ = 0;
  std::int64_t pulse_ns_ = 0;
  std::uint64_t per_period_ = 1;
  std::uint64_t states_ = 0;
  std::uint64_t first_ = 0;      // period of cycle 0
  std::uint64_t delivered_ = 0;  // cycles
  std::uint64_t written_ = 0;    // commands
  std::uint64_t seen_before_ = 0;
  std::uint64_t late_ = 0;
  std::int64_t raw_ = 0;
  bool gone_ = false;
  std::optional<PulseThermometer> thermometer_;
  double hottest_ = 0.0;  // K, what the curve can tell
  ThermometerSample last_;
  Readback readback_;
  std::vector<PeriodTruth> truth_;
};
static_assert(Device<EyeDevice>);

/// Sends one line of text to an eye's socket and returns its answer. Throws Error.
std::string tell_eye(const std::string& socket, const std::string& text);

/// Maps an eye's memory for an observer; it stays mapped until the program ends. Throws Error.
const EyeSharedMemory& observe_eye(const std::string& socket);

}  // namespace photocoag
