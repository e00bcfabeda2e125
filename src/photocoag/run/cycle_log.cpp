#include "photocoag/run/cycle_log.hpp"

namespace photocoag {
namespace {

template <typename E>
E enumeration(std::int64_t number, E last) noexcept {
  return number >= 0 && number <= static_cast<std::int64_t>(last) ? static_cast<E>(number) : E{};
}

constexpr SafetyReason kLastReason = SafetyReason::kCommandLate;

}  // namespace

LogRecord to_log(const CycleRecord& r, const CycleEnd& end) noexcept {
  LogRecord log;
  log.cycle = r.cycle;
  log.time = r.time;
  log.power = r.power;
  log.volume_true = r.truth.volume;
  log.peak_true = r.truth.peak;
  log.measured = r.measured;
  log.volume_estimate = r.estimate.outputs.volume;
  log.peak_estimate = r.estimate.outputs.peak;
  log.peak_sigma = r.estimate.peak_sigma;
  log.absorption = r.estimate.absorption_factor;
  log.absorption_sigma = r.estimate.absorption_sigma;
  log.choroid = r.estimate.choroid_factor;
  log.choroid_sigma = r.estimate.choroid_sigma;
  log.update_status = static_cast<std::int64_t>(r.estimate.status);
  log.wanted_power = r.decision.power;
  log.power_reference = r.decision.power_reference;
  log.solver_status = static_cast<std::int64_t>(r.decision.status);
  log.gate = static_cast<std::int64_t>(r.decision.gate);
  log.iterations = r.decision.iterations;
  log.limit_active = r.decision.limit_active ? 1 : 0;
  log.allowed_power = r.authorization.power;
  log.safety_reason = static_cast<std::int64_t>(r.authorization.reason);
  log.open_interlock = r.authorization.open_interlock ? 1 : 0;
  log.sample_usable = r.sample.usable ? 1 : 0;
  log.sample_verdict = static_cast<std::int64_t>(r.sample.reason);
  log.believed_power = r.sample.power;
  log.safety_state = static_cast<std::int64_t>(r.safety);
  log.stop_reason = static_cast<std::int64_t>(end.safety.reason);
  log.detections = end.safety.detections;
  log.energy = end.safety.energy;
  log.exposure = end.safety.exposure;
  log.dose = end.safety.dose;
  log.overrun = r.overrun ? 1 : 0;
  log.next_power = end.next_power;
  log.device_status = static_cast<std::int64_t>(end.sample.status);
  log.saturated = end.sample.saturated ? 1 : 0;
  log.stop_asked = end.sample.stop_asked ? 1 : 0;
  log.periods_behind = end.sample.periods_behind;
  log.raw = end.sample.raw;
  log.sequence = static_cast<std::int64_t>(end.sample.sequence);
  log.sample_time = end.sample.time_ns;
  log.fetched_time = end.sample.now_ns;
  log.readback = end.readback.power;
  log.device_command = r.device_command;
  log.late_commands = end.safety.late_commands;
  log.interlock_closed = end.readback.interlock_closed ? 1 : 0;
  log.shutter_open = end.readback.shutter_open ? 1 : 0;
  log.foot_switch = end.readback.foot_switch ? 1 : 0;
  return log;
}

CycleRecord from_log(const LogRecord& log) noexcept {
  CycleRecord r;
  r.cycle = log.cycle;
  r.time = log.time;
  r.power = log.power;
  r.truth = {.volume = log.volume_true, .peak = log.peak_true};
  r.measured = log.measured;
  r.estimate = {.outputs = {.volume = log.volume_estimate, .peak = log.peak_estimate},
                .peak_sigma = log.peak_sigma,
                .absorption_factor = log.absorption,
                .absorption_sigma = log.absorption_sigma,
                .choroid_factor = log.choroid,
                .choroid_sigma = log.choroid_sigma,
                .status = enumeration(log.update_status, UpdateStatus::kRestarted)};
  r.decision = {.power = log.wanted_power,
                .power_reference = log.power_reference,
                .status = enumeration(log.solver_status, MpcStatus::kStopped),
                .gate = enumeration(log.gate, GateVerdict::kOutside),
                .iterations = static_cast<int>(log.iterations),
                .limit_active = log.limit_active != 0};
  r.sample = {.usable = log.sample_usable != 0,
              .reason = enumeration(log.sample_verdict, kLastReason),
              .power = log.believed_power};
  r.authorization = {.power = log.allowed_power,
                     .reason = enumeration(log.safety_reason, kLastReason),
                     .open_interlock = log.open_interlock != 0};
  r.safety = enumeration(log.safety_state, SafetyState::kSafeStop);
  r.overrun = log.overrun != 0;
  r.device_command = log.device_command;
  return r;
}

}  // namespace photocoag
