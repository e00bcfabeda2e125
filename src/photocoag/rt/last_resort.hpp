// Role: online; what happens when the program breaks a promise: an exception leaves a noexcept
// function, std::terminate is called, or a fault of the processor ends the program. Used by
// programs that hold a device. Source: docs/safety.md, row S5. Threads: set once, before the loop.
#pragma once

#include "photocoag/device/device.hpp"

namespace photocoag {

/// From now on std::terminate, abort and the signals of faults (SIGFPE, SIGSEGV, SIGBUS, SIGILL)
/// first call off(device), then end the program as before; a signal that has a handler already
/// keeps it. `off` must not throw, allocate or lock. A process that is killed is the device's
/// watchdog's business.
void set_last_resort(void (*off)(void* device) noexcept, void* device) noexcept;

/// While this lives it is safe_off() of a device.
template <Device D>
class LastResort {
 public:
  explicit LastResort(D& device) noexcept {
    set_last_resort([](void* d) noexcept { static_cast<D*>(d)->safe_off(); }, &device);
  }
  ~LastResort() {
    set_last_resort([](void*) noexcept {}, nullptr);
  }
  LastResort(const LastResort&) = delete;
  LastResort& operator=(const LastResort&) = delete;
};

}  // namespace photocoag
