// Role: online; the closed loop of Algorithm 1 on any device, under a supervisor. Used by run,
// fault_table, rt. Source: paper, Algorithm 1; order of a cycle: docs/safety.md. Real time: no
// allocation, lock or I/O of its own; the records' memory is there before.
#pragma once

#include <atomic>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>

#include "photocoag/device/device.hpp"
#include "photocoag/loop/innovation.hpp"
#include "photocoag/loop/paced_eye.hpp"
#include "photocoag/loop/record.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

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
  std::size_t cycles = 0;     ///< records written
  std::size_t overruns = 0;   ///< periods that the controller missed
  bool stopped = false;       ///< ended by a stop request or by the supervisor
  bool goal_reached = false;  ///< ended by the observer's goal
  SafetyStatus safety;        ///< at the end
};

/// Looks on from the loop's thread: time stamps, log, treatment goal. Changes nothing but the end.
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
  noexcept->std::same_as<bool>;  // the treatment has had what it needs
};

struct NoObserver {
  void woke(const DeviceSample&) noexcept {}
  void decided() noexcept {}
  void written() noexcept {}
  void finished(const CycleRecord&, const CycleEnd&) noexcept {}
  bool goal_reached(const CycleRecord&) noexcept { return false; }
};

/// What the loop asks each cycle: may the sample be used, what may be written.
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

/// No supervisor: samples and commands pass as they are. For the paper's own closed loop, and to
/// show that the fault table needs the supervisor.
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

/// The controller's answers as the plain numbers that the supervisor judges.
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

/// K, what the estimator expected of the sample: sample less innovation, or the estimate where
/// there was no update.
inline double predicted_volume(const Estimate& estimate, const DeviceSample& sample,
                               const Innovation& innovation) noexcept {
  return estimate.status == UpdateStatus::kUpdated ? sample.volume_temperature - innovation.value
                                                   : estimate.outputs.volume;
}

/// Read, check, estimate, solve, gate, write, log; until `records` is full, or after a stop. A stop
/// request ends with one period at 0 W; when the supervisor stops, the loop goes on recording 50 ms
/// at 0 W (evidence), as far as there are records. `progress` counts finished cycles. In periods
/// that the loop missed nothing is written: the device holds its power for one, then its watchdog
/// puts 0 W, and the controller gets no sample.
template <Controlling C, Device D, Supervision S, LoopObserver O>
LoopOutcome run_loop(C& controller, D& device, S& supervisor, double period,
                     std::span<CycleRecord> records, std::atomic<std::size_t>& progress,
                     O& observer) noexcept {
  constexpr double kEvidence = 0.05;  // s
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  constexpr double kNothingWritten = kUnknown;
  LoopOutcome outcome;
  if (records.empty()) return outcome;  // nothing would ever switch the laser off again
  std::uint64_t token = 0;
  Decision decision;
  Authorization allowed;
  DeviceStatus written = DeviceStatus::kGood;
  const auto write = [&](double power) {
    written = device.write_power(power, ++token);
    if (allowed.open_interlock || written != DeviceStatus::kGood) device.safe_off();
  };
  const auto decide = [&](const Estimate& estimate) {
    decision = controller.decide();
    allowed = supervisor.authorize(report_of(estimate, decision, innovation_of(controller)));
    observer.decided();
    write(allowed.power);
    observer.written();
  };
  decide(controller.estimate());
  std::size_t end = records.size();
  bool last_period = false;
  bool overrun = false;
  bool stop_asked = false;
  while (outcome.cycles < end) {
    const std::size_t cycle = outcome.cycles;
    const DeviceSample sample = device.wait_sample(cycle);
    observer.woke(sample);
    stop_asked = stop_asked || sample.stop_asked;
    const Readback readback = device.readback();
    const SampleVerdict verdict = supervisor.check(sample, readback, written);
    const Estimate estimate = controller.observe(
        {.volume_temperature =
             verdict.usable ? sample.volume_temperature : std::numeric_limits<double>::quiet_NaN(),
         .applied_power = verdict.power});
    CycleRecord& record = records[outcome.cycles++];
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
    const double predicted = predicted_volume(estimate, sample, innovation_of(controller));
    const auto finish_cycle = [&](double next_power) {
      observer.finished(record, {.sample = sample,
                                 .readback = readback,
                                 .next_power = next_power,
                                 .volume_predicted = predicted,
                                 .safety = supervisor.status()});
    };
    if (overrun && outcome.cycles < end) {  // that period is gone already
      finish_cycle(kNothingWritten);
      continue;
    }
    progress.store(outcome.cycles, std::memory_order_relaxed);
    if (last_period) {
      finish_cycle(kNothingWritten);
      device.heartbeat(cycle);
      break;
    }
    // With the records full the treatment is over by itself.
    const bool goal = !outcome.stopped && observer.goal_reached(record);
    last_period = (stop_asked || goal) && outcome.cycles < end;
    if (last_period || outcome.cycles == end) {
      outcome.stopped = outcome.stopped || (last_period && !goal);
      outcome.goal_reached = goal;
      supervisor.finish();
      decision = {.status = MpcStatus::kStopped};  // 0 W, and one more period to see it recorded
      allowed.power = 0.0;
      observer.decided();
      write(0.0);
      observer.written();
    } else {
      decide(estimate);
      if (!outcome.stopped && supervisor.status().state != SafetyState::kTreating) {
        outcome.stopped = true;
        const auto evidence = static_cast<std::size_t>(std::ceil(kEvidence / period));
        end = outcome.cycles + std::min(end - outcome.cycles, evidence);
      }
    }
    finish_cycle(allowed.power);
    device.heartbeat(cycle);
  }
  progress.store(outcome.cycles, std::memory_order_relaxed);
  outcome.safety = supervisor.status();
  return outcome;
}

/// Overload without observer.
template <Controlling C, Device D, Supervision S>
LoopOutcome run_loop(C& controller, D& device, S& supervisor, double period,
                     std::span<CycleRecord> records, std::atomic<std::size_t>& progress) noexcept {
  NoObserver nobody;
  return run_loop(controller, device, supervisor, period, records, progress, nobody);
}

}  // namespace photocoag
