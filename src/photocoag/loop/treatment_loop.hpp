// Role: online; the closed loop of Algorithm 1 on any device, under a supervisor. Used by run, fmu,
// fault_table, benchmarks. Source: paper, Algorithm 1; order of a cycle: docs/safety.md. Real time:
// no allocation, lock or I/O of its own; the caller allocates the records.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>

#include "photocoag/device/device.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/innovation.hpp"
#include "photocoag/loop/record.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

struct LoopOutcome {
  std::size_t cycles = 0;     ///< records written
  std::size_t overruns = 0;   ///< periods that the controller missed
  bool stopped = false;       ///< ended by a stop request or by the supervisor
  bool goal_reached = false;  ///< ended by the observer's goal
  SafetyStatus safety;        ///< at the end
};

/// Called from the loop's thread: time stamps, log, goal, stop button. Can end the loop, nothing
/// else.
template <typename O>
concept LoopObserver = requires(O observer, const CycleRecord& record, const CycleEnd& end) {
  { observer.woke(end.sample) }
  noexcept;  // the sample is there
  { observer.decided() }
  noexcept;  // the power is chosen and not yet written
  { observer.written() }
  noexcept;
  { observer.finished(record, end) }
  noexcept;  // last thing of every cycle
  { observer.goal_reached(record) }
  noexcept->std::same_as<bool>;  // the treatment's goal is reached
  { observer.stop_asked() }
  noexcept->std::same_as<bool>;  // a stop is requested
};

struct NoObserver {
  void woke(const DeviceSample&) noexcept {}
  void decided() noexcept {}
  void written() noexcept {}
  void finished(const CycleRecord&, const CycleEnd&) noexcept {}
  bool goal_reached(const CycleRecord&) noexcept { return false; }
  bool stop_asked() noexcept { return false; }
};

/// What the loop asks every cycle: may the sample be used, which power may be written.
template <typename S>
concept Supervision = requires(S supervisor, DeviceSample sample, Readback readback,
                               DeviceStatus status, ControllerReport report) {
  { supervisor.check(sample, readback, status) }
  noexcept->std::same_as<SampleVerdict>;
  { supervisor.authorize(report) }
  noexcept->std::same_as<Authorization>;
  { supervisor.status() }
  noexcept->std::convertible_to<SafetyStatus>;
  { supervisor.finish() }
  noexcept;
};

/// No supervisor: samples and commands pass unchanged. For the paper's closed loop, and to show
/// that the fault table needs the supervisor.
class Unsupervised {
 public:
  SampleVerdict check(const DeviceSample& sample, const Readback& readback, DeviceStatus) noexcept {
    return {.usable = sample.periods_behind == 0, .power = readback.power};
  }
  Authorization authorize(const ControllerReport& report) noexcept {
    return {.power = report.command};
  }
  SafetyStatus status() const noexcept { return {.state = SafetyState::kTreating}; }
  void finish() noexcept {}
};

/// What the loop needs of a controller; `Controller` is one.
template <typename C>
concept Controlling = requires(C controller, const C& constant, Sample sample) {
  { controller.observe(sample) }
  noexcept->std::same_as<Estimate>;
  { controller.decide() }
  noexcept->std::same_as<Decision>;
  { controller.estimate() }
  noexcept->std::same_as<Estimate>;
  { innovation_of(constant) }
  noexcept->std::same_as<Innovation>;
};

/// The controller's results as plain numbers for the supervisor.
inline ControllerReport report_of(const Estimate& estimate, const Decision& decision,
                                  const Innovation& innovation) noexcept {
  return {.command = decision.power,
          .solve = decision.status == MpcStatus::kSolved    ? SolveOutcome::kSolved
                   : decision.status == MpcStatus::kRelaxed ? SolveOutcome::kInfeasible
                                                            : SolveOutcome::kFailed,
          .restarted = estimate.status == UpdateStatus::kRestarted,
          .updated = estimate.status == UpdateStatus::kUpdated,
          .peak = estimate.outputs.peak,
          .absorption = estimate.absorption_factor,
          .innovation = innovation.value,
          .innovation_sigma = innovation.sigma,
          .plan = decision.plan};
}

/// Predicted volume temperature, K: sample minus innovation, or the estimate if there was no
/// update.
inline double predicted_volume(const Estimate& estimate, const DeviceSample& sample,
                               const Innovation& innovation) noexcept {
  return estimate.status == UpdateStatus::kUpdated ? sample.volume_temperature - innovation.value
                                                   : estimate.outputs.volume;
}

/// When a treatment ends: when its records are full; after one period at 0 W on a stop request or
/// the goal; kEvidence after the supervisor stopped.
class TreatmentEnd {
 public:
  /// What follows a cycle.
  enum class Next : std::uint8_t {
    kTreat,
    kMissed,  ///< nothing can be written: the next period has already passed
    kDark,    ///< 0 W, and one more period to see it recorded, if there is a record
    kOver,    ///< the treatment is over
  };

  TreatmentEnd(std::size_t records, double period) noexcept
      : end_(records), evidence_(static_cast<std::size_t>(std::ceil(kEvidence / period))) {}

  bool reached(std::size_t cycles) const noexcept { return cycles >= end_; }

  /// After `cycles` cycles. `goal_reached()` is asked once per period that counts for it.
  template <typename G>
  Next after(std::size_t cycles, bool missed, bool stop_asked, G goal_reached) noexcept {
    stop_asked_ = stop_asked_ || stop_asked;
    if (missed && cycles < end_) return Next::kMissed;
    if (last_period_) {
      end_ = cycles;
      return Next::kOver;
    }
    const bool goal = !stopped_ && goal_reached();
    if (cycles < end_ && !stop_asked_ && !goal) return Next::kTreat;
    last_period_ = cycles < end_;  // with full records the treatment ends anyway
    stopped_ = stopped_ || (last_period_ && !goal);
    goal_reached_ = goal;
    return Next::kDark;
  }

  /// The supervisor has stopped: recording continues for kEvidence, as far as there are records.
  void supervisor_stopped(std::size_t cycles) noexcept {
    if (stopped_) return;
    stopped_ = true;
    end_ = cycles + std::min(end_ - cycles, evidence_);
  }

  bool stopped() const noexcept { return stopped_; }
  bool goal_reached() const noexcept { return goal_reached_; }

 private:
  static constexpr double kEvidence = 0.05;  // s
  std::size_t end_;
  std::size_t evidence_;
  bool stop_asked_ = false;
  bool last_period_ = false;
  bool stopped_ = false;
  bool goal_reached_ = false;
};

/// Algorithm 1 with a supervisor: decide, write; then read, check, estimate, decide, write, log
/// until `TreatmentEnd`. In periods that the loop missed nothing is written and the controller gets
/// no sample: the device holds its power for one period, then its watchdog sets 0 W.
template <Controlling C, Device D, Supervision S, LoopObserver O>
LoopOutcome run_loop(C& controller, D& device, S& supervisor, double period,
                     std::span<CycleRecord> records, O& observer) noexcept {
  using Next = TreatmentEnd::Next;
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (records.empty()) return {};  // nothing would ever switch the laser off again
  LoopOutcome outcome;
  TreatmentEnd end(records.size(), period);
  std::uint64_t token = 0;
  Decision decision;
  Authorization allowed;
  DeviceStatus written = DeviceStatus::kGood;
  const auto write = [&] {
    observer.decided();
    written = device.write_power(allowed.power, ++token);
    if (allowed.open_interlock || written != DeviceStatus::kGood) device.safe_off();
    observer.written();
  };
  const auto decide = [&](const Estimate& estimate) {
    decision = controller.decide();
    allowed = supervisor.authorize(report_of(estimate, decision, innovation_of(controller)));
    write();
  };
  decide(controller.estimate());
  bool overrun = false;
  while (!end.reached(outcome.cycles)) {
    const std::size_t cycle = outcome.cycles++;
    DeviceSample sample = device.wait_sample(cycle);
    observer.woke(sample);
    sample.stop_asked = sample.stop_asked || observer.stop_asked();
    const Readback readback = device.readback();
    const SampleVerdict verdict = supervisor.check(sample, readback, written);
    const Estimate estimate = controller.observe(
        {.volume_temperature = verdict.usable ? sample.volume_temperature : kUnknown,
         .applied_power = verdict.power});
    CycleRecord& record = records[cycle];
    record = {.cycle = static_cast<std::int64_t>(cycle),
              .time = static_cast<double>(cycle + 1) * period,
              .power = verdict.power,
              .truth = {.volume = kUnknown, .peak = kUnknown},
              .measured = sample.volume_temperature,
              .estimate = estimate,
              .decision = decision,
              .sample = verdict,
              .authorization = allowed,
              .safety = supervisor.status().state,
              .overrun = overrun,
              .device_command = readback.command};
    if constexpr (requires { device.truth(); }) record.truth = device.truth();
    outcome.overruns += overrun ? 1 : 0;
    overrun = sample.periods_behind > 0;
    CycleEnd cycle_end{
        .sample = sample,
        .readback = readback,
        .next_power = kUnknown,
        .volume_predicted = predicted_volume(estimate, sample, innovation_of(controller)),
        .innovation_sigma =
            estimate.status == UpdateStatus::kUpdated ? innovation_of(controller).sigma : kUnknown,
        .safety = {}};
    const Next next = end.after(outcome.cycles, overrun, sample.stop_asked,
                                [&] { return observer.goal_reached(record); });
    if (next == Next::kTreat) {
      decide(estimate);
      if (supervisor.status().state != SafetyState::kTreating) {
        end.supervisor_stopped(outcome.cycles);
      }
    } else if (next == Next::kDark) {
      supervisor.finish();
      decision = {.status = MpcStatus::kStopped};
      allowed.power = 0.0;
      write();
    }
    if (next == Next::kTreat || next == Next::kDark) cycle_end.next_power = allowed.power;
    cycle_end.safety = supervisor.status();
    observer.finished(record, cycle_end);
    if (next != Next::kMissed) device.heartbeat(cycle);
  }
  outcome.stopped = end.stopped();
  outcome.goal_reached = end.goal_reached();
  outcome.safety = supervisor.status();
  return outcome;
}

/// Overload without observer.
template <Controlling C, Device D, Supervision S>
LoopOutcome run_loop(C& controller, D& device, S& supervisor, double period,
                     std::span<CycleRecord> records) noexcept {
  NoObserver nobody;
  return run_loop(controller, device, supervisor, period, records, nobody);
}

}  // namespace photocoag
