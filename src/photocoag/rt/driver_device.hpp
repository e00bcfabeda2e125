// Role: online; a vendor's driver (device/driver.h) as a Device. Used by run, tests.
// Source: docs/devices.md. Real time: the calls of the loop are noexcept and add no allocation;
// the constructor allocates and throws. Calls restore the thread's floating-point environment,
// whatever the library does. Threads: one owner.
#pragma once

#include <cstdint>
#include <string>

#include "photocoag/device/device.hpp"
#include "photocoag/device/driver.h"

namespace photocoag {

/// Loads the library, checks its table, opens and arms the device; at 0 W until the first write.
class DriverDevice {
 public:
  /// Throws Error naming the library and what is wrong with it. Unless `light_allowed` a driver
  /// that is not simulated is refused before its device is opened.
  DriverDevice(const std::string& library, const std::string& settings, double period,
               bool light_allowed = true);
  ~DriverDevice();
  DriverDevice(const DriverDevice&) = delete;
  DriverDevice& operator=(const DriverDevice&) = delete;

  std::string name() const { return table_->name; }
  bool simulated() const noexcept { return table_->simulated == 1; }

  /// After a self-test: restarts the counts of cycles, samples and tokens.
  void begin() noexcept;

  /// Waits at most one and a half periods. An unknown status counts as gone.
  DeviceSample wait_sample(std::uint64_t cycle) noexcept;
  Readback readback() noexcept;
  DeviceStatus write_power(double power, std::uint64_t token) noexcept;
  void heartbeat(std::uint64_t cycle) noexcept;
  void safe_off() noexcept;

 private:
  void* library_ = nullptr;
  const photocoag_driver_table* table_ = nullptr;
  void* device_ = nullptr;
  std::int64_t period_ns_;
  std::uint64_t sample_ = 0;  // the driver's last
  std::uint64_t token_ = 0;   // the last that it got
  std::uint64_t samples_before_ = 0;
  std::uint64_t tokens_before_ = 0;
};
static_assert(Device<DriverDevice>);

}  // namespace photocoag
