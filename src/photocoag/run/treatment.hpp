// Role: the program's main job; one closed-loop treatment of a simulated eye from a configuration.
// Used by `treat`, `simulate`, tests. Units: SI.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/loop/record.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/observer.hpp"

namespace photocoag {

enum class Pacing { kVirtualTime, kClock };

/// How the crash-safe log ended.
struct LogOutcome {
  LogTotals totals;
  std::int64_t segments = 0;  ///< 0: there was no log
  std::string trouble;        ///< empty: complete
};

struct Treatment {
  std::vector<CycleRecord> records;
  LoopOutcome outcome;
  LoopTiming timing;          ///< empty in virtual time
  CycleHistograms histograms;  ///< empty in virtual time
  LogOutcome log;
  GoalWatch goal;
  bool recovered = false;     ///< from the log of a program that ended early
  std::string scheduling;     ///< what real-time treatment was granted; empty in virtual time
  double wall_seconds = 0.0;  ///< of the loop alone
  std::size_t full_order_states = 0;
};

/// With safety.real_time = "enforce": throws Error unless this machine grants SCHED_FIFO and locked
/// memory to a new thread.
void require_real_time(const Config& config);

/// Builds plant and controller and runs the loop. In virtual time on the calling thread; paced by
/// the clock on a thread of its own. `progress` counts cycles and may be read by another thread.
/// Throws Error before the loop only. `log_folder`: where the crash-safe log goes; empty: none.
Treatment run_treatment(const Config& config, ModelStore& models, Pacing pacing,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress,
                        const std::filesystem::path& log_folder = {}, LogOptions log_options = {});

}  // namespace photocoag
