// Role: online; short histories of the last cycles for the supervisor's checks. Used by safety.
// Source: docs/safety.md. Real time: noexcept, bounded, allocation-free.
#pragma once

#include <bit>
#include <cstdint>

namespace photocoag {

/// Neither infinite nor NaN.
constexpr bool finite(double value) noexcept { return value - value == 0.0; }

/// Sum over the last 20 values.
class RecentSum {
 public:
  void add(double value) noexcept {
    values_[next_] = value;
    next_ = next_ + 1 < kLength ? next_ + 1 : 0;
    full_ = full_ || next_ == 0;
  }
  double sum() const noexcept {
    double total = 0.0;
    for (const double value : values_) total += value;
    return total;
  }
  bool full() const noexcept { return full_; }

 private:
  static constexpr int kLength = 20;
  double values_[kLength]{};
  int next_ = 0;
  bool full_ = false;
};

// Sum of 20 squared normal numbers: below 1.9 or above 76.4 with probability 5e-8 each.
inline constexpr double kQuietest = 1.9;
inline constexpr double kNoisiest = 76.4;

/// One bit per cycle, newest first: counts events among the last 128 cycles.
class RecentEvents {
 public:
  void add(bool event) noexcept {
    older_ = older_ << 1 | recent_ >> 63;
    recent_ = recent_ << 1 | (event ? 1U : 0U);
  }
  int among_last(int cycles) const noexcept {
    if ((recent_ | older_) == 0) return 0;  // nearly always
    const auto mask = [](int bits) {
      return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    };
    return std::popcount(recent_ & mask(cycles)) +
           (cycles > 64 ? std::popcount(older_ & mask(cycles - 64)) : 0);
  }

 private:
  std::uint64_t recent_ = 0;
  std::uint64_t older_ = 0;
};

}  // namespace photocoag
