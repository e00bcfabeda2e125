// Role: offline; tests whether a vendor's driver keeps the promises of device/driver.h. Used by
// `photocoag driver-check`. Source: docs/devices.md ("A driver of your own"). Each promise is tried
// in a process of its own with a deadline: a driver that hangs or crashes fails only that promise.
// Verdicts do not depend on scheduling latency. Units: SI. Real time: none.
#pragma once

#include <string>
#include <vector>

namespace photocoag {

struct DriverCheckSettings {
  std::string library;
  std::string settings;        ///< of the driver
  std::string failing;         ///< driver settings with which open must fail; empty: not tried
  double period = 1e-3;        ///< s
  double power = 1e-3;         ///< W, commanded where a promise needs light
  double patience = 20.0;      ///< s for each promise
  bool light_allowed = false;  ///< required unless the driver is simulated
  std::string only;            ///< one promise; empty: all
};

enum class PromiseVerdict { kKept, kBroken, kNotTried };

struct PromiseResult {
  std::string promise;  ///< a word
  std::string means;    ///< in words
  PromiseVerdict verdict = PromiseVerdict::kNotTried;
  std::string why;  ///< empty if kept
};

struct DriverCheck {
  std::vector<PromiseResult> results;  ///< in their order
  std::string unopened;  ///< why the device could not be opened at all; the rest was not tried
};

/// Throws Error if there is no such library or promise, or if light could come out and is not
/// allowed.
DriverCheck check_driver(const DriverCheckSettings& settings);

}  // namespace photocoag
