// Role: online; paces the loop by the monotonic clock with absolute deadlines. Used by run.
// Real time: no allocation; sleeps by design.
#pragma once

#include <cstddef>
#include <cstdint>

#include "photocoag/rt/clock.hpp"

namespace photocoag {

/// Deadlines t0 + (k + 1) T, never "now + T": after an overrun the phase is unchanged.
class ClockPace {
 public:
  explicit ClockPace(double period) : period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)) {}

  /// t0 = now.
  void start() noexcept { start_ns_ = monotonic_ns(); }

  std::size_t wait_for_end_of(std::size_t cycle) noexcept {
    const std::int64_t deadline = deadline_ns(cycle);
    wait_until(deadline);
    woke_ns_ = monotonic_ns();
    const std::int64_t late = woke_ns_ - deadline;
    return late > 0 ? static_cast<std::size_t>(late / period_ns_) : 0;
  }

  /// End of cycle k on the monotonic clock, and when the loop last woke up.
  std::int64_t deadline_ns(std::size_t cycle) const noexcept {
    return start_ns_ + static_cast<std::int64_t>(cycle + 1) * period_ns_;
  }
  std::int64_t woke_ns() const noexcept { return woke_ns_; }

 private:
  std::int64_t period_ns_;
  std::int64_t start_ns_ = 0;
  std::int64_t woke_ns_ = 0;
};

}  // namespace photocoag
