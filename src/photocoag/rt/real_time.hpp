// Role: online; asks the system for real-time treatment of the calling thread. Used by `treat`.
#pragma once

#include <cstdint>
#include <string>

namespace photocoag {

inline constexpr int kAnyCore = -1;

/// What was granted.
struct RealTime {
  bool fifo_priority = false;  ///< SCHED_FIFO
  bool locked_memory = false;  ///< mlockall: no page of the process is swapped or faulted in later
  int core = kAnyCore;         ///< that the thread runs on alone of all cores
  int cores = 0;               ///< how many it had before
  std::string describe() const;
};

/// SCHED_FIFO of this priority, 1 to 99, for the calling thread. False: not granted. Never throws.
bool request_fifo_priority(int priority) noexcept;

/// Best effort: a machine that grants nothing still runs, with larger latencies. Locks the memory,
/// touches the stack, pins to `core` unless that is kAnyCore. Never throws.
RealTime request_real_time(int core = kAnyCore) noexcept;

/// The calling thread runs on `core` alone. False: it may not. Never throws.
bool pin_to_core(int core) noexcept;

/// The calling thread leaves `core` to others, if there is another one. Never throws.
void keep_off_core(int core) noexcept;

/// Cores on which this process may run, as text: "0, 1".
std::string allowed_cores();
/// How many these are, of the calling thread. Never throws.
int count_allowed_cores() noexcept;

/// Pages that the calling thread has touched and not found in memory.
struct PageFaults {
  std::int64_t minor = 0;  ///< found without the disk
  std::int64_t major = 0;  ///< read from the disk
  PageFaults operator-(const PageFaults& since) const noexcept {
    return {minor - since.minor, major - since.major};
  }
};
PageFaults page_faults() noexcept;

}  // namespace photocoag
