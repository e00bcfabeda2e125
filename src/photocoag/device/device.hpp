// Role: online; the interface of loop and supervisor to a laser with its measurement. Used by loop,
// safety, faults and every backend. Source: docs/devices.md. Units: SI.
// Real time: every call of a Device is noexcept and bounded in time. Threads: one owner.
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>

namespace photocoag {

enum class DeviceStatus : std::uint8_t {
  kGood,
  kTimeout,  ///< no answer within the time allowed
  kGone,     ///< the device has vanished; it will not come back
};

/// Data of one control period, delivered at its end.
struct DeviceSample {
  DeviceStatus status = DeviceStatus::kTimeout;
  bool saturated = false;   ///< the converter was at its rail
  bool stop_asked = false;  ///< the operator requests a stop: stop button, Ctrl-C
  /// Further periods that had already passed when this one was fetched. Above 0 the sample is
  /// outdated and no power can be written for the period after it.
  std::uint32_t periods_behind = 0;
  double volume_temperature = std::numeric_limits<double>::quiet_NaN();  ///< K; NaN: missing
  std::int64_t raw = 0;        ///< the converter's code; constant over many periods: stuck
  std::uint64_t sequence = 0;  ///< 1, 2, …, one per control period
  std::int64_t time_ns = 0;    ///< when it was taken, on the device's monotonic clock
  std::int64_t now_ns = 0;     ///< the same clock when it was fetched
};

/// The device's own report on the period that has just ended.
struct Readback {
  double power = 0.0;  ///< W (commanded scale), mean emitted during the period
  /// W, mean of the command that was in force during the period; NaN: not reported.
  double command = std::numeric_limits<double>::quiet_NaN();
  bool interlock_closed = true;
  bool shutter_open = true;
  bool foot_switch = true;
};

/// A laser with its measurement. `write_power` carries a token that must be new each time: without
/// a fresh token for two periods the device falls to 0 W by itself.
template <typename D>
concept Device = requires(D device, std::uint64_t number, double power) {
  { device.wait_sample(number) }
  noexcept->std::same_as<DeviceSample>;  // at the end of cycle `number` = 0, 1, …
  { device.readback() }
  noexcept->std::same_as<Readback>;
  { device.write_power(power, number) }
  noexcept->std::same_as<DeviceStatus>;
  { device.heartbeat(number) }
  noexcept;  // the work of a cycle is done; feeds no watchdog
  { device.safe_off() }
  noexcept;  // 0 W, interlock open, by any means available
};

}  // namespace photocoag
