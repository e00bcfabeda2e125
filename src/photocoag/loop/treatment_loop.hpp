// Role: online; the closed loop of Algorithm 1 around a simulated eye, in virtual or in real time.
// Used by run. Source: paper, Algorithm 1. Real time: no allocation, lock or I/O; the records'
// memory is there before.
#pragma once

#include <atomic>
#include <concepts>
#include <cstddef>
#include <span>

#include "photocoag/loop/record.hpp"
#include "photocoag/loop/simulated_eye.hpp"

namespace photocoag {

/// What the wait for the end of a period brought.
struct Tick {
  std::size_t missed = 0;  ///< whole further periods that had passed by the time the loop woke up
  bool stop = false;       ///< somebody asked for the end: 0 W now
};

/// Waits for the end of cycle k = 0, 1, …; done() is told when the cycle's work is over.
template <typename P>
concept Pace = requires(P pace, std::size_t cycle) {
  { pace.wait_for_end_of(cycle) }
  noexcept->std::same_as<Tick>;
  { pace.done(cycle) }
  noexcept;
};

/// Virtual time: as fast as it can. Looks at the stop flag once a cycle.
class VirtualPace {
 public:
  explicit VirtualPace(const std::atomic<bool>& stop) : stop_(stop) {}
  Tick wait_for_end_of(std::size_t) noexcept {
    return {.missed = 0, .stop = stop_.load(std::memory_order_relaxed)};
  }
  void done(std::size_t) noexcept {}

 private:
  const std::atomic<bool>& stop_;
};

struct LoopOutcome {
  std::size_t cycles = 0;    ///< records written
  std::size_t overruns = 0;  ///< periods that the controller missed
  bool stopped = false;      ///< ended by a stop request, 0 W in the last record
};

/// Runs until `records` is full or, after a stop request, one period at 0 W has passed. `progress`
/// counts finished cycles. A late wake-up skips the missed periods (the grid of deadlines never
/// moves); in these the laser holds its power for one period, then its watchdog puts 0 W, and the
/// controller gets no sample.
template <PredictiveController M, Plant P, Pace C>
LoopOutcome run_loop(BasicController<M>& controller, SimulatedEye<P>& eye, C& pace, double period,
                     std::span<CycleRecord> records, std::atomic<std::size_t>& progress) noexcept {
  LoopOutcome outcome;
  if (records.empty()) return outcome;  // nothing would ever switch the laser off again
  Decision decision = controller.decide();
  eye.write(decision.power);
  while (outcome.cycles < records.size()) {
    const Tick tick = pace.wait_for_end_of(outcome.cycles);
    for (std::size_t m = 0; m <= tick.missed && outcome.cycles < records.size(); ++m) {
      const std::size_t cycle = outcome.cycles++;
      Reading reading = eye.advance(cycle);
      // Of several periods that have passed only the last one's sample is still fresh.
      if (m < tick.missed) reading.sample.volume_temperature = Sample{}.volume_temperature;
      const bool overrun = m > 0;
      outcome.overruns += overrun ? 1 : 0;
      records[cycle] = {.cycle = static_cast<std::int64_t>(cycle),
                        .time = static_cast<double>(cycle + 1) * period,
                        .power = reading.sample.applied_power,
                        .truth = reading.truth,
                        .measured = reading.sample.volume_temperature,
                        .estimate = controller.observe(reading.sample),
                        .decision = decision,
                        .overrun = overrun};
    }
    progress.store(outcome.cycles, std::memory_order_relaxed);
    if (outcome.stopped) {
      pace.done(outcome.cycles - 1);
      return outcome;
    }
    // With the records full the treatment is over by itself.
    outcome.stopped = tick.stop && outcome.cycles < records.size();
    if (outcome.stopped || outcome.cycles == records.size()) {
      decision = {.status =
                      MpcStatus::kStopped};  // 0 W, and one more period to see it in the record
    } else {
      decision = controller.decide();
    }
    eye.write(decision.power);
    pace.done(outcome.cycles - 1);
  }
  return outcome;
}

}  // namespace photocoag
