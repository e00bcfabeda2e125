// Role: online; what happens when the program breaks a promise: an exception leaves a noexcept
// function, or std::terminate is called. Used by programs that hold a device.
// Source: docs/safety.md, row S5. Threads: set once, before the loop.
#pragma once

namespace photocoag {

/// From now on std::terminate first calls off(device), then aborts. `off` must not throw, allocate
/// or lock. Signals that kill at once are the device's watchdog's business.
void set_last_resort(void (*off)(void* device) noexcept, void* device) noexcept;

}  // namespace photocoag
