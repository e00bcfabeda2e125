// Role: benchmarks; CPU time of a thread. Used by apps, benchmarks. Units: us.
#pragma once

#include <time.h>

namespace photocoag {

/// CPU time of this thread, us: other load on the machine does not count.
inline double thread_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

}  // namespace photocoag
