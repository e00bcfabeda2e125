// Role: online; the floating-point environment of the calling thread, kept over calls of foreign
// code: rounding, traps, flushing of denormals. Used by DriverDevice, last_resort.
// Source: docs/devices.md. Real time: two instructions each way, no allocation.
#pragma once

#include <cfenv>

namespace photocoag {

/// Puts back at its end what it found at its start, exception flags included.
class KeptFloatingPoint {
 public:
  KeptFloatingPoint() noexcept { std::fegetenv(&found_); }
  ~KeptFloatingPoint() { std::fesetenv(&found_); }
  KeptFloatingPoint(const KeptFloatingPoint&) = delete;
  KeptFloatingPoint& operator=(const KeptFloatingPoint&) = delete;

 private:
  std::fenv_t found_;
};

}  // namespace photocoag
