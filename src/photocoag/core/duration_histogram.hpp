// Role: online; a histogram of durations with 1 us bins. Used by run, realtime_check, eye.
// Real time: add() and skip() are noexcept, allocation-free. Threads: one owner.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace photocoag {

/// Bin k counts [k, k + 1) us. Every cycle is counted once: in a bin, as overflow, as negative, or
/// as skipped (no such duration).
class DurationHistogram {
 public:
  /// Bins up to two periods; period in s.
  explicit DurationHistogram(double period = 0.0)
      : DurationHistogram(static_cast<std::size_t>(2.0 * period * 1e6 + 0.5)) {}
  static DurationHistogram with_bins(std::size_t count) { return DurationHistogram(count); }

  void add(std::int64_t ns) noexcept {
    ++counted_;
    least_ = std::min(least_, ns);
    largest_ = std::max(largest_, ns);
    if (ns < 0) {
      ++negative_;
    } else if (const auto bin = static_cast<std::uint64_t>(ns / 1000); bin < bins_.size()) {
      ++bins_[static_cast<std::size_t>(bin)];
    } else {
      ++overflow_;
    }
  }
  void skip() noexcept { ++skipped_; }

  const std::vector<std::uint64_t>& bins() const noexcept { return bins_; }
  std::uint64_t overflow() const noexcept { return overflow_; }
  std::uint64_t negative() const noexcept { return negative_; }
  std::uint64_t skipped() const noexcept { return skipped_; }
  std::uint64_t counted() const noexcept { return counted_; }
  /// One entry per cycle.
  std::uint64_t cycles() const noexcept { return counted() + skipped_; }
  /// us, exact; 0 without entries.
  double min_us() const noexcept {
    return counted() > 0 ? static_cast<double>(least_) * 1e-3 : 0.0;
  }
  double max_us() const noexcept {
    return counted() > 0 ? static_cast<double>(largest_) * 1e-3 : 0.0;
  }
  /// us: upper edge of the bin below which at least this fraction of the entries lies; at most the
  /// largest entry.
  double quantile_us(double fraction) const noexcept {
    const double wanted = fraction * static_cast<double>(counted());
    auto sum = static_cast<double>(negative_);
    if (sum >= wanted) return std::min(0.0, max_us());
    for (std::size_t k = 0; k < bins_.size(); ++k) {
      sum += static_cast<double>(bins_[k]);
      if (sum >= wanted) return std::min(static_cast<double>(k + 1), max_us());
    }
    return max_us();
  }

 private:
  explicit DurationHistogram(std::size_t bins) : bins_(bins) {}

  std::vector<std::uint64_t> bins_;
  std::uint64_t counted_ = 0;
  std::uint64_t overflow_ = 0;
  std::uint64_t negative_ = 0;
  std::uint64_t skipped_ = 0;
  std::int64_t least_ = std::numeric_limits<std::int64_t>::max();
  std::int64_t largest_ = std::numeric_limits<std::int64_t>::min();
};

}  // namespace photocoag
