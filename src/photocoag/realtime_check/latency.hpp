// Role: setup; wake-up latency of a real-time thread, measured as by cyclictest, and with
// cyclictest itself. Used by `latency`, tests. Source: docs/realtime.md.
#pragma once

#include <atomic>
#include <string>
#include <string_view>

#include "photocoag/core/duration_histogram.hpp"

namespace photocoag {

struct WakeLatency {
  DurationHistogram histogram;
  std::uint64_t whole_periods_missed = 0;
  std::string scheduling;  ///< what was granted
};

/// Sleeps to absolute deadlines on a thread scheduled like the treatment loop; one entry per
/// wake-up. Deadlines that have passed by more than a period are skipped and counted.
WakeLatency measure_wake_latency(double seconds, double period, const std::atomic<bool>& stop);

/// cyclictest of rt-tests for the same time, period and priority, at the same time. Empty histogram
/// and a reason if it is not installed or fails.
struct CyclictestRun {
  bool ran = false;
  std::string why_not = {};
  DurationHistogram histogram{};
};
CyclictestRun run_cyclictest(double seconds, double period);

/// Parses the output of `cyclictest -q -h`: lines "latency count", comments, overflows.
DurationHistogram parse_cyclictest(std::string_view output, double period);

}  // namespace photocoag
