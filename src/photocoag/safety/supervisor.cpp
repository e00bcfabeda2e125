#include "photocoag/safety/supervisor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "photocoag/safety/bands.hpp"

namespace photocoag {

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

SelfTestBounds self_test_bounds(const SafetyLimits& limits, int samples) noexcept {
  constexpr double kRounding = 1e-9;  // K
  const double of_mean = limits.noise / std::sqrt(std::max(1, samples));
  // 5 standard errors: 3 would refuse one healthy start in 370.
  return {.mean = 5.0 * std::hypot(of_mean, limits.zero_error) + kRounding,
          .sigma_low = limits.check_quiet == 0 ? 0.0 : 0.5 * limits.noise,
          .sigma_high = 2.0 * limits.noise + kRounding};
}

Supervisor::Supervisor(const SafetyLimits& limits, const WitnessModel& model) noexcept
    : limits_(limits), model_(model), witness_(model, limits.noise, limits.model_error) {}

void Supervisor::power_on() noexcept {
  if (status_.state == SafetyState::kOff) status_.state = SafetyState::kSelfTest;
}

bool Supervisor::finish_self_test(const SelfTestReport& report) noexcept {
  if (status_.state != SafetyState::kSelfTest) return false;
  const SelfTestBounds bounds = self_test_bounds(*limits_, report.samples);
  const bool good =
      report.samples >= SelfTestBounds::kSamples && std::abs(report.mean) <= bounds.mean &&
      report.sigma <= bounds.sigma_high && report.sigma >= bounds.sigma_low &&
      std::abs(report.power_at_zero) <= kReadbackFloor && report.watchdog_tripped &&
      report.model_matches && report.solver_exact && report.log_has_room && limits_.intact();
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
  // Once done, only a fault changes the state.
  if (status_.state == SafetyState::kDone && state != SafetyState::kSafeStop) return;
  status_.state = state;
  status_.reason = reason;
}

void Supervisor::notice(SafetyReason reason) noexcept {
  ++status_.detections;
  status_.last_detection = reason;
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
  const double settling = memory_.settling;
  const bool settles = memory_.cycles > 0 && memory_.cycles <= kAbsorptionSettled;
  const double moved =
      settles ? std::clamp(1.0 - memory_.absorption / report.absorption, -1.0, 1.0) : 0.0;
  memory_.settling = settles ? std::max(0.5 * settling, moved * moved) : 0.0;
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
    // Innovations may be as large as the estimator expects, the calibrated noise, the model's error
    // or what the estimator's linearization has left. They are never smaller than the noise.
    const double square = report.innovation * report.innovation;
    const double noise = limits_->noise * limits_->noise;
    const double expected = report.innovation_sigma * report.innovation_sigma;
    const double model =
        (limits_->model_error + kSettlingShare * settling) * witness_.volume_high();
    memory_.innovations.add(square);
    memory_.excess.add(square / std::max({expected, noise, model * model}));
    const bool quiet = limits_->check_quiet != 0 && memory_.innovations.full() &&
                       memory_.innovations.sum() < kQuietest * noise;
    if (!(memory_.excess.sum() <= kNoisiest) || quiet) {
      stop(SafetyState::kSafeStop, SafetyReason::kInconsistent);
    }
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
                      planned <= witness_.power_for_peak(limits_->peak_max / hidden_gain());
  return std::min(
      memory_.written,
      usable ? planned : witness_.steady_power(limits_->peak_reference / hidden_gain()));
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
  const double peak_max = limits_->peak_max / hidden_gain();
  lower_to(witness_.power_for_peak(peak_max), SafetyReason::kPeakCeiling);
  if (limits_->command_held != 0) {
    // If the next write is missed, the device holds this power for one more period; if this one
    // comes late, the power before.
    lower_to(witness_.held_power_for_peak(peak_max), SafetyReason::kPeakCeiling);
    lower_to(witness_.late_power_for_peak(peak_max, memory_.written), SafetyReason::kPeakCeiling);
  }
  lower_to((limits_->energy_max - status_.energy - on_its_way()) /
               (limits_->period * (1.0 + limits_->power_accuracy)),
           SafetyReason::kEnergy);
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
