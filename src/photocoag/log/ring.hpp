// Role: online; lock-free queue from one producer to one consumer. Used by log, run, console. Real
// time: push and pop are noexcept, wait-free, allocation-free. Threads: one of each side.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace photocoag {

template <typename T>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Room for at least `capacity` entries (rounded up to a power of two). Touches all of it.
  explicit SpscRing(std::size_t capacity)
      : slots_(std::bit_ceil(std::max<std::size_t>(capacity, 2))) {}

  /// Producer side. False if full; nothing is changed.
  bool push(const T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == slots_.size()) return false;
    slots_[head & (slots_.size() - 1)] = value;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Consumer side: takes the oldest entries that fit into `out`; returns their number.
  std::size_t pop(std::span<T> out) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    const std::size_t count = std::min(head_.load(std::memory_order_acquire) - tail, out.size());
    for (std::size_t i = 0; i < count; ++i) out[i] = slots_[(tail + i) & (slots_.size() - 1)];
    tail_.store(tail + count, std::memory_order_release);
    return count;
  }

  std::size_t capacity() const noexcept { return slots_.size(); }

 private:
  std::vector<T> slots_;
  // Each on a cache line of its own: producer and consumer do not disturb each other.
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace photocoag
