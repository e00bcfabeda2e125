// Role: online; a treatment's LoopObserver: durations, records to the log and to live viewers,
// progress, the treatment's goal and a stop flag. Used by run, fault_table. Source:
// docs/realtime.md. Real time: all calls of the loop are noexcept, bounded, allocation-free.
// Threads: the loop's.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "photocoag/core/duration_histogram.hpp"
#include "photocoag/log/ring.hpp"
#include "photocoag/log/writer.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/run/goal.hpp"

namespace photocoag {

/// Durations of the parts of a cycle; every cycle counts once in each.
struct CycleHistograms {
  explicit CycleHistograms(double period = 0.0)
      : wake_late(period), compute(period), write(period), slack(period) {}
  DurationHistogram wake_late;  ///< from the end of the period to the wake-up
  DurationHistogram compute;    ///< read, check, estimate, solve, gate; without the simulated eye
  DurationHistogram write;      ///< the device's write call
  DurationHistogram slack;      ///< from the end of the write to the next deadline
};

/// Durations in ns, cycle by cycle.
struct LoopTiming {
  std::vector<std::int64_t> wake_late;
  std::vector<std::int64_t>
      cycle;  ///< all work from the wake-up on: a simulated eye's and the log's
};

/// Outputs of the observer, and what may end the loop. Pointers may be null.
struct Watch {
  const std::atomic<bool>* stop = nullptr;
  std::atomic<std::size_t>* progress = nullptr;  ///< finished cycles
  LogWriter* log = nullptr;
  SpscRing<LogRecord>* live = nullptr;  ///< if full, cycles are dropped
  GoalWatch goal = {};
};

class TreatmentObserver {
 public:
  /// `timed`: number of cycles to keep durations of; 0: none, the device's clock is not the
  /// monotonic one.
  TreatmentObserver(double period, std::size_t timed, Watch watch)
      : watch_(watch),
        period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)),
        timed_(timed > 0),
        histograms_(timed_ ? period : 0.0) {
    timing_.wake_late.reserve(timed);
    timing_.cycle.reserve(timed);
  }

  void woke(const DeviceSample&) noexcept {
    decided_ns_ = 0;
    if (timed_) woke_ns_ = monotonic_ns();
  }
  void decided() noexcept {
    if (timed_) decided_ns_ = monotonic_ns();
  }
  void written() noexcept {
    if (timed_) written_ns_ = monotonic_ns();
  }
  void finished(const CycleRecord& record, const CycleEnd& end) noexcept {
    if (watch_.progress != nullptr) {
      watch_.progress->store(static_cast<std::size_t>(record.cycle) + 1, std::memory_order_relaxed);
    }
    if (!timed_ && watch_.log == nullptr && watch_.live == nullptr) return;
    LogRecord logged(record, end);
    if (timed_) measure(end.sample, logged);
    if (watch_.log != nullptr) watch_.log->record(logged);
    if (watch_.live != nullptr) watch_.live->push(logged);  // full: the viewer sees a gap
    if (timed_ && decided_ns_ != 0) add(timing_.cycle, monotonic_ns() - end.sample.now_ns);
  }
  bool goal_reached(const CycleRecord& record) noexcept {
    watch_.goal.add(record.estimate.outputs.peak);
    return watch_.goal.reached();
  }
  bool stop_asked() noexcept {
    return watch_.stop != nullptr && watch_.stop->load(std::memory_order_relaxed);
  }
  const GoalWatch& goal() const noexcept { return watch_.goal; }
  const LoopTiming& timing() const noexcept { return timing_; }

  const CycleHistograms& histograms() const noexcept { return histograms_; }

 private:
  static void add(std::vector<std::int64_t>& all, std::int64_t duration) noexcept {
    if (all.size() < all.capacity()) all.push_back(duration);
  }
  void measure(const DeviceSample& sample, LogRecord& logged) noexcept {
    logged.wake_late = sample.now_ns - sample.time_ns;
    histograms_.wake_late.add(logged.wake_late);
    add(timing_.wake_late, logged.wake_late);
    if (decided_ns_ == 0) {  // nothing was written in this cycle
      histograms_.compute.skip();
      histograms_.write.skip();
      histograms_.slack.skip();
      return;
    }
    logged.compute = decided_ns_ - woke_ns_;
    logged.write = written_ns_ - decided_ns_;
    logged.slack = sample.time_ns + period_ns_ - written_ns_;
    histograms_.compute.add(logged.compute);
    histograms_.write.add(logged.write);
    histograms_.slack.add(logged.slack);
  }

  Watch watch_;
  std::int64_t period_ns_;
  bool timed_;
  CycleHistograms histograms_;
  LoopTiming timing_;
  std::int64_t woke_ns_ = 0;
  std::int64_t decided_ns_ = 0;
  std::int64_t written_ns_ = 0;
};
static_assert(LoopObserver<TreatmentObserver>);

}  // namespace photocoag
