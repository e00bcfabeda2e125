// Role: the program's main job; one closed-loop treatment of a simulated eye from a configuration.
// Used by `treat`, `simulate`, tests. Units: SI.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/loop/record.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/model_cache.hpp"

namespace photocoag {

enum class Pacing { kVirtualTime, kClock };

/// What only a treatment on a device knows.
struct DeviceReport {
  std::string name;
  int pulses_per_period = 0;     ///< 0: it does not say
  std::int64_t late_pulses = 0;  ///< answered after the next was due
  double pulse_peak_max = 0.0;   ///< K, true, right after a pulse; NaN: not known
  std::string status;            ///< the eye's own counts, as it says them
};

struct Treatment {
  std::vector<CycleRecord> records;
  LoopOutcome outcome;
  LoopTiming timing;          ///< empty in virtual time
  std::string scheduling;     ///< what real-time treatment was granted; empty in virtual time
  double wall_seconds = 0.0;  ///< of the loop alone
  std::size_t full_order_states = 0;
  std::optional<DeviceReport> device;  ///< none: the simulated eye of this process
};

/// With safety.real_time = "enforce": throws Error unless this machine grants SCHED_FIFO and locked
/// memory to a new thread.
void require_real_time(const Config& config);

/// Builds plant and controller and runs the loop. In virtual time on the calling thread; paced by
/// the clock on a thread of its own. `progress` counts cycles and may be read by another thread.
/// Throws Error before the loop only.
Treatment run_treatment(const Config& config, ModelStore& models, Pacing pacing,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress);

}  // namespace photocoag
