// Role: offline; the promises of device/driver.h, each as a trial of a driver. Used by driver_check
// only, each in a process of its own. Source: docs/devices.md. Units: SI. Real time: none.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "photocoag/rt/driver_check.hpp"

namespace photocoag {

struct BrokenPromise {
  std::string why;
};
struct UnopenedDevice {
  std::string why;
};
struct NotTried {
  std::string why;
};

struct Promise {
  std::string name;
  std::string means;
  /// Throws one of the above; returns if the promise is kept.
  std::function<void(const DriverCheckSettings&)> keep;
};

/// The first promise is that there is a table of functions, the second that open works.
const std::vector<Promise>& driver_promises();

/// Starts counting the library's own allocations. Throws NotTried where that is not supported.
/// `library`: handle from dlopen.
void count_allocations(void* library);
long counted_allocations() noexcept;

}  // namespace photocoag
