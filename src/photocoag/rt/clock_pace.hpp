// Role: online; paces the loop by the monotonic clock with absolute deadlines. Used by `treat`.
// Real time: no allocation after construction; sleeps by design.
#pragma once

#include <atomic>
#include <cstdint>

#include "photocoag/loop/record.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rt/clock.hpp"

namespace photocoag {

/// Deadlines t0 + (k + 1) T, never "now + T": after an overrun the phase is unchanged.
class ClockPace {
 public:
  /// timing: sized for all cycles beforehand; entries beyond are not recorded.
  ClockPace(double period, std::size_t cycles, const std::atomic<bool>& stop)
      : period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)), stop_(stop) {
    timing_.wake_late.reserve(cycles);
    timing_.cycle.reserve(cycles);
  }

  /// t0 = now.
  void start() noexcept { start_ns_ = monotonic_ns(); }

  Tick wait_for_end_of(std::size_t cycle) noexcept {
    const std::int64_t deadline = deadline_ns(cycle);
    wait_until(deadline);
    woke_ns_ = monotonic_ns();
    const std::int64_t late = woke_ns_ - deadline;
    if (timing_.wake_late.size() < timing_.wake_late.capacity()) timing_.wake_late.push_back(late);
    return {.missed = late > 0 ? static_cast<std::size_t>(late / period_ns_) : 0,
            .stop = stop_.load(std::memory_order_relaxed)};
  }

  void done(std::size_t) noexcept {
    if (timing_.cycle.size() < timing_.cycle.capacity()) {
      timing_.cycle.push_back(monotonic_ns() - woke_ns_);
    }
  }

  /// End of cycle k on the monotonic clock, and when the loop last woke up.
  std::int64_t deadline_ns(std::size_t cycle) const noexcept {
    return start_ns_ + static_cast<std::int64_t>(cycle + 1) * period_ns_;
  }
  std::int64_t woke_ns() const noexcept { return woke_ns_; }

  const LoopTiming& timing() const noexcept { return timing_; }

 private:
  std::int64_t period_ns_;
  std::int64_t start_ns_ = 0;
  std::int64_t woke_ns_ = 0;
  const std::atomic<bool>& stop_;
  LoopTiming timing_;
};

}  // namespace photocoag
