#include "photocoag/safety/supervisor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "photocoag/tissue/thermal_dose.hpp"

namespace photocoag {
namespace {

// Counts and bands of docs/safety.md.
constexpr int kMissingMax = 2;
constexpr int kSaturatedMax = 1;
constexpr int kSameRawMax = 5;
constexpr int kRejectedMax = 2;          // among the last 20
constexpr double kRejectAt = 6.0;        // standard deviations
constexpr double kResidualLimit = 36.0;  // squared: one spike is no proof of noise
// Sum of 20 squared normal numbers: below 1.9 or above 76.4 with probability 5e-8 each.
constexpr double kQuietest = 1.9;
constexpr double kNoisiest = 76.4;
constexpr int kFallbacksMax = 2;
constexpr int kInfeasibleMax = 19;
constexpr int kAbsorptionBadMax = 9;
constexpr double kAbsorptionJump = 0.3;
constexpr std::int64_t kAbsorptionSettled = 10;  // cycles
constexpr double kPeakEstimateExcess = 1.0;      // K
constexpr int kPeakEstimatesMax = 2;
constexpr double kReadbackRelative = 0.2;
constexpr double kReadbackFloor = 2e-3;  // W
constexpr int kLateCommandsMax = 3;      // in a row
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

bool finite(double value) noexcept { return value - value == 0.0; }

bool close_to(double power, double wanted) noexcept {
  const double off = std::abs(power - wanted);
  return off <= kReadbackRelative * wanted || off <= kReadbackFloor;
}

}  // namespace

void Supervisor::Window::add(double value) noexcept { values_[count_++ % kLength] = value; }

double Supervisor::Window::sum() const noexcept {
  double total = 0.0;
  for (const double value : values_) total += value;
  return total;
}

void Supervisor::History::add(bool event) noexcept {
  older_ = older_ << 1 | recent_ >> 63;
  recent_ = recent_ << 1 | (event ? 1U : 0U);
}

int Supervisor::History::among_last(int cycles) const noexcept {
  const auto mask = [](int bits) {
    return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
  };
  return std::popcount(recent_ & mask(cycles)) +
         (cycles > 64 ? std::popcount(older_ & mask(cycles - 64)) : 0);
}

Supervisor::Supervisor(const SafetyLimits& limits, const WitnessModel& model) noexcept
    : limits_(limits), model_(model), witness_(model, limits.noise, limits.model_error) {}

void Supervisor::power_on() noexcept {
  if (status_.state == SafetyState::kOff) status_.state = SafetyState::kSelfTest;
}

bool Supervisor::finish_self_test(const SelfTestReport& report) noexcept {
  if (status_.state != SafetyState::kSelfTest) return false;
  const double noise = limits_->noise;
  // 5 standard errors: 3 would refuse one healthy start in 370.
  const bool mean_good =
      std::abs(report.mean) <= 5.0 * noise / std::sqrt(std::max(1, report.samples)) + 1e-9;
  const bool sigma_good = report.sigma <= 2.0 * noise + 1e-9 &&
                          (limits_->check_quiet == 0 || report.sigma >= 0.5 * noise);
  const bool good = report.samples >= 32 && mean_good && sigma_good &&
                    std::abs(report.power_at_zero) <= kReadbackFloor && report.watchdog_tripped &&
                    report.model_matches && report.solver_exact && report.log_has_room &&
                    limits_.intact();
  if (good) {
    status_.state = SafetyState::kStandby;
  } else {
    stop(SafetyState::kSafeStop, SafetyReason::kSelfTest);
  }
  return good;
}

bool Supervisor::ready() noexcept {
  if (status_.state != SafetyState::kStandby) return false;
  status_.state = SafetyState::kReady;
  status_.reason = SafetyReason::kNone;
  return true;
}

bool Supervisor::begin(bool foot_switch) noexcept {
  if (status_.state != SafetyState::kReady || !foot_switch) return false;
  status_.state = SafetyState::kTreating;
  return true;
}

void Supervisor::reset() noexcept {
  if (status_.state != SafetyState::kSafeStop && status_.state != SafetyState::kDone) return;
  status_ = {.state = SafetyState::kSelfTest};
  memory_ = {};
  witness_ = Witness(model_, limits_->noise, limits_->model_error);
}

void Supervisor::finish() noexcept {
  remember(0.0);  // the loop writes 0 W itself
  if (status_.state == SafetyState::kTreating) status_.state = SafetyState::kDone;
}

void Supervisor::stop(SafetyState state, SafetyReason reason, bool open_interlock) noexcept {
  notice(reason);
  memory_.open_interlock = memory_.open_interlock || open_interlock;
  if (status_.state == SafetyState::kSafeStop) return;  // the first reason stays
  // Nothing but a fault changes what is over already.
  if (status_.state == SafetyState::kDone && state != SafetyState::kSafeStop) return;
  status_.state = state;
  status_.reason = reason;
}

void Supervisor::notice(SafetyReason reason) noexcept {
  ++status_.detections;
  status_.last_detection = reason;
}

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
  const SafetyReason reason = judge(sample);
  memory_.fresh_sample = reason == SafetyReason::kNone;
  if (memory_.fresh_sample) witness_.learn(sample.volume_temperature);
  memory_.overrun = sample.periods_behind > 0;
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
  if (!finite(command) || memory_.overrun) return InForce::kUnknown;
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
  if (!told && memory_.overrun) return;
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

void Supervisor::account(double power) noexcept {
  witness_.emit(power);
  if (limits_->command_delay != 0) witness_.await(memory_.written);
  status_.energy += power * limits_->period;
  if (power > 0.0) status_.exposure += limits_->period;
  const ArrheniusParameters tissue{.name = {},
                                   .end_point = {},
                                   .log_frequency = limits_->dose_log_frequency,
                                   .activation_energy = limits_->dose_activation_energy};
  const double peak = witness_.peak_high();
  if (limits_->dose_max > 0.0) {
    status_.dose += damage_over(tissue, limits_->ambient_celsius + memory_.peak_high,
                                limits_->ambient_celsius + peak, limits_->period);
  }
  memory_.peak_high = peak;
  if (status_.state != SafetyState::kTreating) return;
  // The next period must not go beyond: stop one period before at the last power.
  if (status_.energy + memory_.written * limits_->period > limits_->energy_max) {
    stop(SafetyState::kDone, SafetyReason::kEnergy);
  }
  if (status_.exposure + 0.5 * limits_->period > limits_->exposure_max) {
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

void Supervisor::check_estimate(const ControllerReport& report) noexcept {
  if (report.restarted) {
    notice(SafetyReason::kEstimatorRestart);
    ++memory_.restarts;
    if (memory_.restarts > 1) stop(SafetyState::kSafeStop, SafetyReason::kEstimatorRestart);
  }
  const bool outside =
      !(report.absorption > limits_->absorption_min && report.absorption < limits_->absorption_max);
  const bool jumped = memory_.cycles > kAbsorptionSettled &&
                      std::abs(report.absorption - memory_.absorption) > kAbsorptionJump;
  memory_.absorption = report.absorption;
  memory_.absorption_bad = outside || jumped ? memory_.absorption_bad + 1 : 0;
  if (memory_.absorption_bad > 0) {
    notice(SafetyReason::kAbsorption);
    witness_.doubt();
  }
  if (memory_.absorption_bad > kAbsorptionBadMax) {
    stop(SafetyState::kSafeStop, SafetyReason::kAbsorption);
  }
  if (report.updated) {
    const double ratio = report.innovation / report.innovation_sigma;
    memory_.innovations.add(ratio * ratio);
    const double sum = memory_.innovations.sum();
    const bool quiet = limits_->check_quiet != 0 && memory_.innovations.full() && sum < kQuietest;
    if (!(sum <= kNoisiest) || quiet) stop(SafetyState::kSafeStop, SafetyReason::kInconsistent);
  }
  // NaN counts as too high.
  const bool hot = !(report.peak <= limits_->peak_max + kPeakEstimateExcess);
  memory_.peak_high_estimates = hot ? memory_.peak_high_estimates + 1 : 0;
  if (memory_.peak_high_estimates > kPeakEstimatesMax) {
    stop(SafetyState::kSafeStop, SafetyReason::kEstimatedPeak);
  }
}

double Supervisor::fallback(SafetyReason reason) noexcept {
  notice(reason);
  if (++memory_.fallbacks > kFallbacksMax) {
    stop(SafetyState::kSafeStop, reason);
    return 0.0;
  }
  // What the last good plan had in store, if no plausible absorption is overheated by it. A plan
  // made with an estimate that has broken down since is none.
  const double planned = memory_.plan[static_cast<std::size_t>(memory_.fallbacks - 1)];
  const bool usable = reason != SafetyReason::kEstimatorRestart && planned >= 0.0 &&
                      planned <= witness_.power_for_peak(limits_->peak_max);
  return std::min(memory_.written,
                  usable ? planned : witness_.steady_power(limits_->peak_reference));
}

Authorization Supervisor::choose(const ControllerReport& report) noexcept {
  if (memory_.peak_high_estimates > 0) {
    notice(SafetyReason::kEstimatedPeak);
    return {.power = 0.0, .reason = SafetyReason::kEstimatedPeak};
  }
  memory_.infeasible = report.solve == SolveOutcome::kInfeasible ? memory_.infeasible + 1 : 0;
  if (memory_.infeasible > 0) {
    notice(SafetyReason::kInfeasible);
    if (memory_.infeasible > kInfeasibleMax) {
      stop(SafetyState::kSafeStop, SafetyReason::kInfeasible);
    }
    return {.power = 0.0, .reason = SafetyReason::kInfeasible};
  }
  const bool invalid = !finite(report.command) || report.command < 0.0 ||
                       report.command > limits_->power_max * (1.0 + 1e-12);
  SafetyReason reason = report.solve == SolveOutcome::kFailed ? SafetyReason::kSolverFailed
                        : invalid                             ? SafetyReason::kCommandInvalid
                        : report.restarted                    ? SafetyReason::kEstimatorRestart
                                                              : SafetyReason::kNone;
  double power = report.command;
  if (reason == SafetyReason::kNone) {
    memory_.fallbacks = 0;
    memory_.plan = report.plan;
  } else {
    power = fallback(reason);
  }
  const auto lower_to = [&](double most, SafetyReason why) {
    if (power <= most) return;
    power = most;
    reason = reason == SafetyReason::kNone ? why : reason;
  };
  lower_to(limits_->power_max, SafetyReason::kNone);  // rounding
  lower_to(memory_.written + limits_->power_rise_max, SafetyReason::kSlew);
  if (!memory_.fresh_sample) lower_to(memory_.written, SafetyReason::kCoasting);
  lower_to(witness_.power_for_peak(limits_->peak_max), SafetyReason::kPeakCeiling);
  // If the next write never comes, the device holds this power for one more period.
  lower_to(witness_.held_power_for_peak(limits_->peak_max + limits_->hold_excess),
           SafetyReason::kPeakCeiling);
  return {.power = power, .reason = reason};
}

void Supervisor::remember(double power) noexcept {
  memory_.written_earlier = memory_.written_before;
  memory_.written_before = memory_.written;
  memory_.written = power;
}

Authorization Supervisor::authorize(const ControllerReport& report) noexcept {
  Authorization answer{.power = 0.0, .reason = SafetyReason::kNotTreating};
  if (status_.state == SafetyState::kTreating) {
    check_estimate(report);
    if (status_.state == SafetyState::kTreating) answer = choose(report);
  }
  // Whatever happened before: only TREATING emits, only finite powers within the limit.
  const bool allowed = status_.state == SafetyState::kTreating && limits_.intact() &&
                       answer.power >= 0.0 && answer.power <= limits_->power_max;
  if (!allowed) {
    answer.power = 0.0;
    answer.reason =
        status_.reason == SafetyReason::kNone ? SafetyReason::kNotTreating : status_.reason;
  }
  answer.open_interlock = memory_.open_interlock;
  remember(answer.power);
  return answer;
}

}  // namespace photocoag
