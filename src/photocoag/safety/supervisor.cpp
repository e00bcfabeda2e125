#include "photocoag/safety/supervisor.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/safety/device_check.hpp"
#include "photocoag/safety/recent.hpp"

namespace photocoag {
namespace {

constexpr int kFallbacksMax = 2;    // in a row
constexpr int kInfeasibleMax = 19;  // in a row

}  // namespace

SelfTestBounds self_test_bounds(const SafetyLimits& limits, int samples) noexcept {
  constexpr double kRounding = 1e-9;  // K
  const double of_mean = limits.noise / std::sqrt(std::max(1, samples));
  // 5 standard errors: 3 would refuse one healthy start in 370.
  return {.mean = 5.0 * std::hypot(of_mean, limits.zero_error) + kRounding,
          .sigma_low = limits.check_quiet == 0 ? 0.0 : 0.5 * limits.noise,
          .sigma_high = 2.0 * limits.noise + kRounding};
}

Supervisor::Supervisor(const SafetyLimits& limits, const ObserverModel& model) noexcept
    : limits_(limits), model_(model), observer_(model, limits.noise, limits.model_error) {}

void Supervisor::power_on() noexcept {
  if (latch_.status.state == SafetyState::kOff) latch_.status.state = SafetyState::kSelfTest;
}

bool Supervisor::finish_self_test(const SelfTestReport& report) noexcept {
  if (latch_.status.state != SafetyState::kSelfTest) return false;
  const SelfTestBounds bounds = self_test_bounds(*limits_, report.samples);
  const bool good = report.samples >= SelfTestBounds::kSamples &&
                    std::abs(report.mean) <= bounds.mean && report.sigma <= bounds.sigma_high &&
                    report.sigma >= bounds.sigma_low &&
                    std::abs(report.power_at_zero) <= kReadbackFloor && report.switches_ready() &&
                    report.watchdog_tripped && report.model_matches && report.solver_exact &&
                    report.log_has_room && limits_.intact();
  if (good) {
    latch_.status.state = SafetyState::kStandby;
  } else {
    latch_.safe_stop(SafetyReason::kSelfTest);
  }
  return good;
}

bool Supervisor::ready() noexcept {
  if (latch_.status.state != SafetyState::kStandby) return false;
  latch_.status.state = SafetyState::kReady;
  latch_.status.reason = SafetyReason::kNone;
  return true;
}

bool Supervisor::begin(bool foot_switch) noexcept {
  if (latch_.status.state != SafetyState::kReady || !foot_switch) return false;
  latch_.status.state = SafetyState::kTreating;
  return true;
}

void Supervisor::reset() noexcept {
  const SafetyState state = latch_.status.state;
  if (state != SafetyState::kSafeStop && state != SafetyState::kDone) return;
  latch_ = {};
  latch_.status.state = SafetyState::kSelfTest;
  memory_ = {};
  observer_ = MultiModelObserver(model_, limits_->noise, limits_->model_error);
}

void Supervisor::finish() noexcept {
  memory_.power.write(0.0);  // the loop writes 0 W itself
  if (latch_.status.state == SafetyState::kTreating) latch_.status.state = SafetyState::kDone;
}

SampleVerdict Supervisor::check(const DeviceSample& sample, const Readback& readback,
                                DeviceStatus last_write) noexcept {
  ++memory_.cycles;
  if (!limits_.intact()) latch_.safe_stop(SafetyReason::kLimitsCorrupted);
  check_device(sample, readback, last_write, latch_);
  const InForce command = memory_.power.in_force(readback.command, *limits_);
  memory_.clock.check(sample, command == InForce::kLate, *limits_, latch_);
  memory_.power.check(readback, command, sample.status, *limits_, latch_);

  const double power = memory_.power.emitted(readback, *limits_);
  observer_.emit(power);
  if (limits_->command_delay != 0) observer_.queue(memory_.power.written());
  memory_.dose.account(power, memory_.power.written(), memory_.power.on_its_way(*limits_),
                       observer_, *limits_, latch_);
  memory_.power.check_excess(readback, observer_, *limits_, latch_);

  const SafetyReason reason = memory_.sample.check(sample, observer_, *limits_, latch_);
  memory_.fresh_sample = reason == SafetyReason::kNone;
  if (memory_.fresh_sample) observer_.update(sample.volume_temperature);
  memory_.power.end_period(sample.periods_behind > 0, *limits_);
  return {.usable = memory_.fresh_sample, .reason = reason, .power = power};
}

// The last good plan's next power if it overheats no plausible absorption; else the steady power
// for the reference. A plan made from an estimate that has since failed does not count.
double Supervisor::fallback(SafetyReason reason) noexcept {
  latch_.notice(reason);
  if (++memory_.fallbacks > kFallbacksMax) {
    latch_.safe_stop(reason);
    return 0.0;
  }
  const double planned = memory_.plan[static_cast<std::size_t>(memory_.fallbacks - 1)];
  const double gain = limits_->hidden_gain();
  const bool usable = reason != SafetyReason::kEstimatorRestart && planned >= 0.0 &&
                      planned <= observer_.power_for_peak(limits_->peak_max / gain);
  return std::min(memory_.power.written(),
                  usable ? planned : observer_.steady_power(limits_->peak_reference / gain));
}

Authorization Supervisor::choose(const ControllerReport& report) noexcept {
  if (memory_.estimate.too_hot()) {
    latch_.notice(SafetyReason::kEstimatedPeak);
    return {.power = 0.0, .reason = SafetyReason::kEstimatedPeak};
  }
  memory_.infeasible = report.solve == SolveOutcome::kInfeasible ? memory_.infeasible + 1 : 0;
  if (memory_.infeasible > 0) {
    latch_.notice(SafetyReason::kInfeasible);
    if (memory_.infeasible > kInfeasibleMax) latch_.safe_stop(SafetyReason::kInfeasible);
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
  const double written = memory_.power.written();
  lower_to(limits_->power_max, SafetyReason::kNone);  // rounding
  lower_to(written + limits_->power_rise_max, SafetyReason::kSlew);
  if (!memory_.fresh_sample) lower_to(written, SafetyReason::kCoasting);
  const double peak_max = limits_->peak_max / limits_->hidden_gain();
  lower_to(observer_.power_for_peak(peak_max), SafetyReason::kPeakCeiling);
  if (limits_->command_held != 0) {
    // If the next write is missed, the device holds this power for one more period; if this one
    // comes late, the power before.
    lower_to(observer_.held_power_for_peak(peak_max), SafetyReason::kPeakCeiling);
    lower_to(observer_.late_power_for_peak(peak_max, written), SafetyReason::kPeakCeiling);
  }
  lower_to(DoseCheck::power_left(latch_.status, memory_.power.on_its_way(*limits_), *limits_),
           SafetyReason::kEnergy);
  return {.power = power, .reason = reason};
}

Authorization Supervisor::authorize(const ControllerReport& report) noexcept {
  const SafetyStatus& status = latch_.status;
  Authorization answer{.power = 0.0, .reason = SafetyReason::kNotTreating};
  if (status.state == SafetyState::kTreating) {
    memory_.estimate.check(report, memory_.cycles, observer_, *limits_, latch_);
    if (status.state == SafetyState::kTreating) answer = choose(report);
  }
  // Whatever happened before: only TREATING emits, only finite powers within the limit.
  const bool allowed = status.state == SafetyState::kTreating && limits_.intact() &&
                       answer.power >= 0.0 && answer.power <= limits_->power_max;
  if (!allowed) {
    answer.power = 0.0;
    answer.reason =
        status.reason == SafetyReason::kNone ? SafetyReason::kNotTreating : status.reason;
  }
  answer.open_interlock = latch_.open_interlock;
  memory_.power.write(answer.power);
  return answer;
}

}  // namespace photocoag
