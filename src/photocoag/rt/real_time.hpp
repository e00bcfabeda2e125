// Role: online; asks the system for real-time treatment of the calling thread. Used by `treat`.
#pragma once

#include <string>

namespace photocoag {

/// What was granted.
struct RealTime {
  bool fifo_priority = false;  ///< SCHED_FIFO
  bool locked_memory = false;  ///< mlockall: no page of the process is swapped or faulted in later
  std::string describe() const;
};

/// SCHED_FIFO of this priority, 1 to 99, for the calling thread. False: not granted. Never throws.
bool request_fifo_priority(int priority) noexcept;

/// Best effort: a machine that grants nothing still runs, with larger latencies. Never throws.
RealTime request_real_time() noexcept;

}  // namespace photocoag
