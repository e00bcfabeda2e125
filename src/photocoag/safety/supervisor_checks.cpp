// The first half of a cycle: what the device delivered. States and gate are in supervisor.cpp.
#include <algorithm>
#include <cmath>

#include "photocoag/safety/bands.hpp"
#include "photocoag/safety/supervisor.hpp"
#include "photocoag/tissue/thermal_dose.hpp"

namespace photocoag {
namespace {

bool close_to(double power, double wanted) noexcept {
  const double off = std::abs(power - wanted);
  return off <= kReadbackRelative * wanted || off <= kReadbackFloor;
}

}  // namespace

SampleVerdict Supervisor::check(const DeviceSample& sample, const Readback& readback,
                                DeviceStatus last_write) noexcept {
  ++memory_.cycles;
  if (!limits_.intact()) stop(SafetyState::kSafeStop, SafetyReason::kLimitsCorrupted);
  check_device(sample, readback, last_write);
  const InForce command = judge_command(readback.command);
  check_clock(sample, command);
  check_readback(readback, command);
  const bool power_known =
      finite(readback.power) && readback.power >= 0.0 && readback.power <= 2.0 * limits_->power_max;
  // Where the two differ too much the larger one counts: the peak must not be underestimated.
  const double power = !power_known               ? memory_.written
                       : memory_.readback_off > 0 ? std::max(readback.power, memory_.written)
                                                  : readback.power;
  account(power);
  judge_excess(readback, power_known);
  const SafetyReason reason = judge(sample);
  memory_.fresh_sample = reason == SafetyReason::kNone;
  if (memory_.fresh_sample) witness_.learn(sample.volume_temperature);
  memory_.unwritten = sample.periods_behind > 0 ? 1 + limits_->command_delay
                                                : std::max<std::int64_t>(0, memory_.unwritten - 1);
  return {.usable = memory_.fresh_sample, .reason = reason, .power = power};
}

void Supervisor::check_device(const DeviceSample& sample, const Readback& readback,
                              DeviceStatus last_write) noexcept {
  if (sample.status == DeviceStatus::kGone || last_write == DeviceStatus::kGone) {
    stop(SafetyState::kSafeStop, SafetyReason::kDeviceGone, true);
  } else if (last_write != DeviceStatus::kGood) {
    stop(SafetyState::kSafeStop, SafetyReason::kWriteFailed, true);
  }
  if (!readback.interlock_closed) stop(SafetyState::kSafeStop, SafetyReason::kInterlock);
  if (!readback.shutter_open) stop(SafetyState::kSafeStop, SafetyReason::kShutter);
  if (!readback.foot_switch) stop(SafetyState::kStandby, SafetyReason::kFootSwitch);
}

double Supervisor::wanted() const noexcept {
  return limits_->command_delay == 0 ? memory_.written : memory_.written_before;
}

Supervisor::InForce Supervisor::judge_command(double command) const noexcept {
  // After a missed period the device was right to hold or to go dark.
  if (!finite(command) || memory_.unwritten > 0) return InForce::kUnknown;
  if (close_to(command, wanted())) return InForce::kAsWritten;
  // The power before, some of both, or a watchdog that had waited too long.
  const double before =
      limits_->command_delay == 0 ? memory_.written_before : memory_.written_earlier;
  const bool ours = command >= std::min(before, wanted()) - kReadbackFloor &&
                    command <= std::max(before, wanted()) + kReadbackFloor;
  return ours || command == 0.0 ? InForce::kLate : InForce::kForeign;
}

void Supervisor::check_readback(const Readback& readback, InForce command) noexcept {
  const bool told = finite(readback.command);
  if (!told && memory_.unwritten > 0) return;
  // A device that says what it took for its command is held to its word.
  const double expected = told ? readback.command : wanted();
  const bool foreign = command == InForce::kForeign;
  if ((expected <= 0.0 && !(readback.power <= kReadbackFloor)) || (foreign && wanted() == 0.0)) {
    stop(SafetyState::kSafeStop, SafetyReason::kPowerStuckOn, true);
    return;
  }
  const bool differs = foreign || !close_to(readback.power, expected);
  // Without light there is nothing to compare: 0 W neither counts nor clears.
  if (differs) {
    ++memory_.readback_off;
  } else if (expected > 0.0) {
    memory_.readback_off = 0;
  }
  if (differs) notice(SafetyReason::kPowerReadback);
  if (memory_.readback_off >= 2) stop(SafetyState::kSafeStop, SafetyReason::kPowerReadback, true);
}

/// Power that is not what was commanded is given a second period, unless the same again overheats.
void Supervisor::judge_excess(const Readback& readback, bool power_known) noexcept {
  if (memory_.readback_off == 0 || !power_known || !(readback.power > memory_.written)) return;
  if (readback.power > witness_.power_for_peak(limits_->peak_max / hidden_gain())) {
    stop(SafetyState::kSafeStop, SafetyReason::kPowerReadback, true);
  }
}

void Supervisor::check_clock(const DeviceSample& sample, InForce command) noexcept {
  memory_.late_commands = command == InForce::kLate ? memory_.late_commands + 1 : 0;
  if (command == InForce::kLate) {
    ++status_.late_commands;
    notice(SafetyReason::kCommandLate);
  }
  if (memory_.late_commands > kLateCommandsMax) {
    stop(SafetyState::kSafeStop, SafetyReason::kCommandLate, true);
  }
  // A sample that lies behind says that the write after it was missed. A write that came late is
  // as bad.
  const bool behind = sample.periods_behind > 0;
  const bool late = behind || command == InForce::kLate;
  memory_.overrun_history.add(late);
  if (behind) notice(SafetyReason::kOverrun);
  memory_.overruns = late ? memory_.overruns + 1 : 0;
  if (memory_.overruns > limits_->overruns_in_a_row_max ||
      memory_.overrun_history.among_last(100) > limits_->overruns_per_hundred) {
    stop(SafetyState::kSafeStop, SafetyReason::kOverrun);
  }
}

/// How much hotter the tissue may be than the witness says, relative to its rise: by the power that
/// the readback does not show before there are samples, and by what the samples do not show after.
/// The peak grows less than the volume temperature with alpha, so that both together are not worse.
double Supervisor::hidden_gain() const noexcept {
  return std::max(1.0 + limits_->power_accuracy, 1.0 / (1.0 - limits_->gain_accuracy));
}

/// J, written already and not emitted yet.
double Supervisor::on_its_way() const noexcept {
  return limits_->command_delay == 0
             ? 0.0
             : memory_.written * (1.0 + limits_->power_accuracy) * limits_->period;
}

void Supervisor::account(double power) noexcept {
  witness_.emit(power);
  if (limits_->command_delay != 0) witness_.await(memory_.written);
  status_.energy += power * (1.0 + limits_->power_accuracy) * limits_->period;
  if (power > 0.0) status_.exposure += limits_->period;
  const ArrheniusParameters tissue{.name = {},
                                   .end_point = {},
                                   .log_frequency = limits_->dose_log_frequency,
                                   .activation_energy = limits_->dose_activation_energy};
  const double peak = hidden_gain() * witness_.peak_high();
  if (limits_->dose_max > 0.0) {
    status_.dose += damage_over(tissue, limits_->ambient_celsius + memory_.peak_high,
                                limits_->ambient_celsius + peak, limits_->period);
  }
  memory_.peak_high = peak;
  if (status_.state != SafetyState::kTreating) return;
  // The next period must not go beyond: stop one period before at the last power.
  const double coming = on_its_way();
  if (status_.energy + coming +
          memory_.written * (1.0 + limits_->power_accuracy) * limits_->period >
      limits_->energy_max) {
    stop(SafetyState::kDone, SafetyReason::kEnergy);
  }
  const double periods = coming > 0.0 ? 1.5 : 0.5;
  if (status_.exposure + periods * limits_->period > limits_->exposure_max) {
    stop(SafetyState::kDone, SafetyReason::kExposure);
  }
  if (limits_->dose_max > 0.0 && !(status_.dose < limits_->dose_max)) {
    stop(SafetyState::kDone, SafetyReason::kThermalDose);
  }
}

SafetyReason Supervisor::judge(const DeviceSample& sample) noexcept {
  SafetyReason reason = SafetyReason::kNone;
  const auto period_ns = static_cast<std::int64_t>(limits_->period * kNsPerSecond);
  const std::int64_t age = sample.now_ns - sample.time_ns;
  ++memory_.expected;
  double outside = 0.0;
  if (sample.periods_behind > 0) {
    // An overrun of ours: counted there, the sample is not the device's fault.
    memory_.rejected.add(false);
    return SafetyReason::kOverrun;
  }
  if (sample.status != DeviceStatus::kGood || !finite(sample.volume_temperature)) {
    reason = SafetyReason::kSampleMissing;
  } else if (sample.saturated) {
    reason = SafetyReason::kSampleSaturated;
  } else if (sample.sequence < memory_.expected || age > period_ns * 3 / 2 ||
             age < -period_ns / 10) {
    reason = SafetyReason::kSampleStale;
  } else {
    const WitnessResidual residual = witness_.compare(sample.volume_temperature);
    outside = residual.outside;
    watch_noise(residual.outside);
    if (outside > kRejectAt) reason = SafetyReason::kSampleRejected;
    witness_.suspect(outside > kRejectAt && residual.above);
  }
  // Stuck is judged on everything that looks like a sample.
  if (reason == SafetyReason::kNone || reason == SafetyReason::kSampleRejected) {
    memory_.same_raw = sample.raw == memory_.raw ? memory_.same_raw + 1 : 1;
    memory_.raw = sample.raw;
    memory_.expected = sample.sequence;
    if (memory_.same_raw >= kSameRawMax && limits_->check_quiet != 0) {
      stop(SafetyState::kSafeStop, SafetyReason::kSampleStuck);
      reason = SafetyReason::kSampleStuck;
    }
  }
  count_bad(reason);
  return reason;
}

void Supervisor::count_bad(SafetyReason reason) noexcept {
  const bool missing =
      reason == SafetyReason::kSampleMissing || reason == SafetyReason::kSampleStale;
  memory_.missing = missing ? memory_.missing + 1 : 0;
  const bool saturated = reason == SafetyReason::kSampleSaturated;
  memory_.saturated = saturated ? memory_.saturated + 1 : 0;
  memory_.rejected.add(reason == SafetyReason::kSampleRejected);
  if (reason != SafetyReason::kNone) notice(reason);
  if (memory_.missing > kMissingMax) stop(SafetyState::kSafeStop, reason);
  if (memory_.saturated > kSaturatedMax) stop(SafetyState::kSafeStop, reason);
  if (memory_.rejected.among_last(20) > kRejectedMax) {
    stop(SafetyState::kSafeStop, SafetyReason::kSampleRejected);
  }
}

void Supervisor::watch_noise(double residual) noexcept {
  memory_.residuals.add(std::min(residual * residual, kResidualLimit));
  if (memory_.residuals.sum() > kNoisiest) {
    stop(SafetyState::kSafeStop, SafetyReason::kMeasurementNoise);
  }
}

}  // namespace photocoag
