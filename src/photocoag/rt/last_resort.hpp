// Role: online; switches the laser off when the program crashes: an exception leaves a noexcept
// function, std::terminate is called, or a processor fault occurs. Used by run, fault_table.
// Source: docs/safety.md, row S5. Threads: set once, before the loop.
#pragma once

#include "photocoag/device/device.hpp"

namespace photocoag {

/// From now on std::terminate, abort and the fault signals (SIGFPE, SIGSEGV, SIGBUS, SIGILL) first
/// call off(device), then end the program as before; existing signal handlers stay. `off` must not
/// throw, allocate or lock. After SIGKILL only the device's watchdog helps.
void set_last_resort(void (*off)(void* device) noexcept, void* device) noexcept;

/// During its lifetime the last resort is the device's safe_off().
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
