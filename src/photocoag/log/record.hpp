// Role: online; everything recorded of one cycle, as written to the crash-safe log. Used by log,
// run, run_files, console. Units: SI; times of the monotonic clock and durations in ns.
#pragma once

#include <cstdint>
#include <limits>
#include <type_traits>

#include "photocoag/loop/record.hpp"

namespace photocoag {

/// A cycle's record with its durations.
struct LogRecord : CycleRecord {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  static constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::min();

  /// All values unknown.
  LogRecord() noexcept {
    truth = {.volume = kNone, .peak = kNone};
    measured = kNone;
    end.next_power = end.volume_predicted = end.readback.power = kNone;
  }
  LogRecord(const CycleRecord& cycle_record, const CycleEnd& cycle_end) noexcept
      : CycleRecord(cycle_record), end(cycle_end) {}

  std::int64_t record = 0;  ///< 0, 1, … as the loop produced them; a gap: dropped
  CycleEnd end;
  std::int64_t wake_late = kNoTime;
  std::int64_t compute = kNoTime;
  std::int64_t write = kNoTime;
  std::int64_t slack = kNoTime;
};
static_assert(std::is_trivially_copyable_v<LogRecord>);

}  // namespace photocoag
