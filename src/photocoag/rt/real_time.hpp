// Role: online; requests real-time scheduling of the calling thread. Used by run, eye, log,
// realtime_check.
#pragma once

#include <cstdint>
#include <string>

namespace photocoag {

inline constexpr int kAnyCore = -1;

/// What was granted.
struct RealTime {
  bool fifo_priority = false;  ///< SCHED_FIFO
  bool locked_memory = false;  ///< mlockall: no page of the process is swapped or faulted in later
  int core = kAnyCore;         ///< core to which the thread is pinned
  int cores = 0;               ///< allowed cores before pinning
  std::string describe() const;
};

/// SCHED_FIFO of this priority, 1 to 99, for the calling thread. False: not granted. Never throws.
bool request_fifo_priority(int priority) noexcept;

/// SCHED_FIFO, locked memory, touched stack, pinning to `core` unless kAnyCore. Best effort: what
/// is not granted costs latency only. Never throws.
RealTime request_real_time(int core = kAnyCore) noexcept;

/// Pins the calling thread to `core`. False: not granted. Never throws.
bool pin_to_core(int core) noexcept;

/// Keeps the calling thread off `core`, if there is another one. Never throws.
void keep_off_core(int core) noexcept;

/// Cores on which this process may run, as text: "0, 1".
std::string allowed_cores();
/// Number of cores allowed to the calling thread. Never throws.
int count_allowed_cores() noexcept;

/// Page faults of the calling thread.
struct PageFaults {
  std::int64_t minor = 0;  ///< served without disk access
  std::int64_t major = 0;  ///< read from the disk
  PageFaults operator-(const PageFaults& since) const noexcept {
    return {minor - since.minor, major - since.major};
  }
};
PageFaults page_faults() noexcept;

}  // namespace photocoag
