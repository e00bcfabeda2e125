// Role: program; the part that every treatment shares, whatever the device: the loop and what is
// measured of it. Used by run.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <span>

#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rt/real_time.hpp"
#include "photocoag/run/observer.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// What every loop gets from its caller.
struct LoopContext {
  const std::atomic<bool>& stop;
  std::atomic<std::size_t>& progress;
  LogWriter* log = nullptr;  ///< may be null
  const Onlooker& onlooker;

  bool log_is_good() const noexcept { return log == nullptr || log->healthy(); }
};

/// The closed loop on this thread. `timed`: the device's clock is the monotonic one.
template <Controlling C, Device D, Supervision S>
void close_loop(const Config& config, C& controller, D& device, S& supervisor, bool timed,
                const LoopContext& context, Treatment& treatment) {
  const double period = config.control.period;
  TreatmentObserver observer(period, timed ? treatment.records.size() : 0,
                             {.stop = &context.stop,
                              .progress = &context.progress,
                              .log = context.log,
                              .live = context.onlooker.live,
                              .goal = GoalWatch(config)});
  const auto begin = std::chrono::steady_clock::now();
  const PageFaults before = page_faults();
  treatment.outcome =
      run_loop(controller, device, supervisor, period, std::span(treatment.records), observer);
  treatment.page_faults = page_faults() - before;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  treatment.wall_seconds = wall.count();
  if (timed) treatment.histograms = observer.histograms();
  treatment.timing = observer.timing();
  treatment.goal = observer.goal();
  treatment.records.resize(treatment.outcome.cycles);
}

}  // namespace photocoag
