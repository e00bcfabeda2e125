// Role: online; absolute deadlines on the monotonic clock. Used by rt, eye, log, run,
// realtime_check, console.
// Real time: no allocation, no lock; wait_until blocks until the deadline by design.
#pragma once

#include <cstdint>

namespace photocoag {

/// CLOCK_MONOTONIC in nanoseconds: not affected by changes of the wall clock.
std::int64_t monotonic_ns() noexcept;

/// Sleeps until `deadline_ns` on CLOCK_MONOTONIC; returns at once if it has passed.
void wait_until(std::int64_t deadline_ns) noexcept;

}  // namespace photocoag
