// Role: the program's main job; one closed-loop treatment of a simulated eye from a configuration.
// Used by `treat`, `simulate`, spots, margins, studies, campaigns: whatever closes the loop on a
// simulated eye does it here, with any solver and estimator, supervised or not. Units: SI.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/loop/record.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/run/model_cache.hpp"

namespace photocoag {

enum class Pacing { kVirtualTime, kClock };

struct Treatment {
  std::vector<CycleRecord> records;
  LoopOutcome outcome;
  LoopTiming timing;          ///< empty in virtual time
  std::string scheduling;     ///< what real-time treatment was granted; empty in virtual time
  double wall_seconds = 0.0;  ///< of the loop alone
  std::size_t full_order_states = 0;
};

/// With safety.real_time = "enforce": throws Error unless this machine grants SCHED_FIFO and locked
/// memory to a new thread.
void require_real_time(const Config& config);

/// Builds plant and controller and runs the loop. In virtual time on the calling thread; paced by
/// the clock on a thread of its own. `progress` counts cycles and may be read by another thread.
/// Throws Error before the loop only.
Treatment run_treatment(const Config& config, ModelStore& models, Pacing pacing,
                        const std::atomic<bool>& stop, std::atomic<std::size_t>& progress);

/// The simulated eye's physics, one of the two.
struct EyeModel {
  std::shared_ptr<const FullOrderModel> full;
  const ReducedModel* reduced = nullptr;
};

/// What a study does to an eye that has no key in the configuration.
struct EyeOptions {
  double sensor_gain = 1.0;           ///< error of the calibration
  double sensor_offset = 0.0;         ///< K
  std::optional<int> delay;           ///< periods, if not what control.delay_cycles says
  std::optional<double> first_power;  ///< W, instead of the first decision
  bool self_test = true;              ///< false: taken as passed (thousands of eyes)
};

/// One treatment in virtual time on the calling thread with models that are there already; the
/// configuration's tissue is not looked at. Throws Error on bad settings.
Treatment simulate_eye(const Config& config, const ReducedModel& model, const EyeModel& eye,
                       const EyeOptions& options = {});

}  // namespace photocoag
