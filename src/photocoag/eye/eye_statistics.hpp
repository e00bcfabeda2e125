// Role: simulation; what the eye's process counts of itself. Used by eye, apps. Real time: add is
// noexcept, allocation-free.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace photocoag {

/// Durations in bins of 1 us; the last bin holds all that is longer.
class Histogram {
 public:
  static constexpr std::size_t kBins = 1000;
  void add(std::int64_t ns) noexcept;
  std::uint64_t count() const noexcept { return count_; }
  double max_us() const noexcept { return static_cast<double>(max_ns_) * 1e-3; }
  /// Upper end of the bin in which that fraction is reached, us.
  double percentile_us(double fraction) const noexcept;
  std::uint64_t bin(std::size_t i) const noexcept { return bins_[i]; }

 private:
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

struct EyeStatistics {
  Histogram work;    ///< own work per pulse, answer and tissue
  Histogram answer;  ///< from the time when the pulse was due to its publication
  std::uint64_t pulses = 0;
  std::uint64_t late = 0;       ///< answered after the next pulse was due
  std::uint64_t watchdog = 0;   ///< pulses at 0 W though a command above 0 W was the last one
  double peak_mean_max = 0.0;   ///< K
  double peak_pulse_max = 0.0;  ///< K
  std::string scheduling;
};

/// The statistics as lines of text with a histogram.
std::string to_text(const EyeStatistics& statistics);

}  // namespace photocoag
