// Role: online; preserves the calling thread's floating-point environment across foreign code:
// rounding, traps, flushing of denormals. Used by DriverDevice, last_resort.
// Source: docs/devices.md. Real time: two instructions each way, no allocation.
#pragma once

#include <cfenv>

namespace photocoag {

/// Restores the environment found at construction, exception flags included.
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
