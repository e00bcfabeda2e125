// Role: simulation; statistics of the eye's process. Used by eye, apps. Real time: filling it is
// noexcept, allocation-free.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "photocoag/core/duration_histogram.hpp"

namespace photocoag {

struct EyeStatistics {
  static constexpr std::size_t kBins = 1000;  ///< of 1 us

  /// Computing time per pulse, answer and tissue.
  DurationHistogram work = DurationHistogram::with_bins(kBins);
  /// From the pulse's due time to its publication.
  DurationHistogram answer = DurationHistogram::with_bins(kBins);
  std::uint64_t pulses = 0;
  std::uint64_t late = 0;       ///< answered after the next pulse was due
  std::uint64_t watchdog = 0;   ///< pulses at 0 W though a command above 0 W was the last one
  std::uint64_t refused = 0;    ///< commands beyond the laser's limit
  std::uint64_t lockstep = 0;   ///< pulses in lockstep with a controller; not timed
  double power_max = 0.0;       ///< W, the laser's limit
  double peak_mean_max = 0.0;   ///< K
  double peak_pulse_max = 0.0;  ///< K
  std::string scheduling;
};

/// The statistics as lines of text with a histogram.
std::string to_text(const EyeStatistics& statistics);

}  // namespace photocoag
