// Role: the program; the supervisor's self-test against a device. Used by run.
// Source: docs/safety.md. Units: SI.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "photocoag/device/device.hpp"
#include "photocoag/run/device_address.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

/// Samples of the cold eye at 0 W, then a trip of the watchdog with 1 mW (less if the laser has
/// less) unless interlock, shutter or foot switch forbid light, and time to cool down; in cycles
/// from `first` on. Throws DeviceError if the device vanishes.
template <Device D>
SelfTestReport self_test(D& device, const ControlSettings& control, bool log_has_room,
                         std::uint64_t first = 0) {
  constexpr std::size_t kSamples = 64;
  constexpr std::uint64_t kMostCycles = 512;
  const double little = std::min(1e-3, control.power_max);  // W
  std::uint64_t cycle = first;
  std::uint64_t token = 0;
  std::vector<double> baseline;
  double power_at_zero = 0.0;
  const auto wait = [&] {
    const DeviceSample sample = device.wait_sample(cycle++);
    if (sample.status == DeviceStatus::kGone) {
      throw DeviceError(ErrorParts{.where = "self-test", .problem = "the device has vanished"});
    }
    return sample;
  };
  const auto write = [&](double power) { device.write_power(power, ++token); };
  write(0.0);
  while (baseline.size() < kSamples && cycle - first < kMostCycles) {
    const DeviceSample sample = wait();
    write(0.0);
    if (sample.periods_behind > 0) continue;
    if (std::isfinite(sample.volume_temperature)) baseline.push_back(sample.volume_temperature);
    power_at_zero = std::max(power_at_zero, device.readback().power);
  }
  SelfTestReport report = self_test_of(baseline);
  report.power_at_zero = power_at_zero;
  const auto read_switches = [&] {
    const Readback now = device.readback();
    report.interlock_closed = now.interlock_closed;
    report.shutter_open = now.shutter_open;
    report.foot_switch = now.foot_switch;
    return report.switches_ready();
  };
  double seen = 0.0;
  // Retry only if nothing was emitted because the command came too late.
  for (int tries = 0; tries < 3 && !(seen > 0.0) && read_switches(); ++tries) {
    write(little);
    double last = std::numeric_limits<double>::quiet_NaN();
    for (int k = 0; k < 4 + control.delay; ++k) {
      wait();
      last = device.readback().power;
      seen = std::max(seen, last);
    }
    report.watchdog_tripped = last == 0.0 && seen > 0.0;
  }
  for (int k = 0; k < 50; ++k) {
    write(0.0);
    wait();
  }
  write(0.0);
  read_switches();
  report.model_matches = true;  // ModelStore has refused any other
  report.solver_exact = solver_is_exact();
  report.log_has_room = log_has_room;
  return report;
}

}  // namespace photocoag
