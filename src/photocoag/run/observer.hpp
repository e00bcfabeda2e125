// Role: online; what `treat` sees of its loop: durations into histograms, records into the log and
// to who looks on, the treatment's goal. Used by run. Source: docs/realtime.md. Real time: all
// calls of the loop are noexcept, bounded, allocation-free. Threads: the loop's.
#pragma once

#include <cstdint>

#include "photocoag/core/duration_histogram.hpp"
#include "photocoag/log/ring.hpp"
#include "photocoag/log/writer.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/run/goal.hpp"

namespace photocoag {

/// Durations of the cycles' parts; every cycle counts once in each.
struct CycleHistograms {
  explicit CycleHistograms(double period = 0.0)
      : wake_late(period), compute(period), write(period), slack(period) {}
  DurationHistogram wake_late;  ///< from the end of the period to the wake-up
  DurationHistogram compute;    ///< read, check, estimate, solve, gate; no eye
  DurationHistogram write;      ///< the device's write call
  DurationHistogram slack;      ///< from the end of the write to the next deadline
};

/// In virtual time: goal only.
class TreatmentObserver {
 public:
  /// log, live: may be null. timed: the device's clock is the monotonic one.
  TreatmentObserver(double period, bool timed, LogWriter* log, const GoalWatch& goal = {},
                    SpscRing<LogRecord>* live = nullptr)
      : goal_(goal),
        period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)),
        timed_(timed),
        log_(log),
        live_(live),
        histograms_(timed ? period : 0.0) {}

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
    if (!timed_ && log_ == nullptr && live_ == nullptr) return;
    LogRecord logged(record, end);
    if (timed_) measure(end.sample, logged);
    if (log_ != nullptr) log_->record(logged);
    if (live_ != nullptr) live_->push(logged);  // full: the onlooker sees a gap
  }
  bool goal_reached(const CycleRecord& record) noexcept {
    goal_.add(record.estimate.outputs.peak);
    return goal_.reached();
  }
  const GoalWatch& goal() const noexcept { return goal_; }

  const CycleHistograms& histograms() const noexcept { return histograms_; }

 private:
  void measure(const DeviceSample& sample, LogRecord& logged) noexcept {
    logged.wake_late = sample.now_ns - sample.time_ns;
    histograms_.wake_late.add(logged.wake_late);
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

  GoalWatch goal_;
  std::int64_t period_ns_;
  bool timed_;
  LogWriter* log_;
  SpscRing<LogRecord>* live_;
  CycleHistograms histograms_;
  std::int64_t woke_ns_ = 0;
  std::int64_t decided_ns_ = 0;
  std::int64_t written_ns_ = 0;
};
static_assert(LoopObserver<TreatmentObserver>);

}  // namespace photocoag
