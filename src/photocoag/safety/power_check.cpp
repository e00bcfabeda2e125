#include "photocoag/safety/power_check.hpp"

#include <algorithm>
#include <cmath>

#include "photocoag/safety/recent.hpp"

namespace photocoag {
namespace {

bool close_to(double power, double wanted) noexcept {
  const double off = std::abs(power - wanted);
  return off <= kReadbackRelative * wanted || off <= kReadbackFloor;
}

}  // namespace

double PowerCheck::wanted(const SafetyLimits& limits) const noexcept {
  return limits.command_delay == 0 ? written_ : written_before_;
}

InForce PowerCheck::in_force(double command, const SafetyLimits& limits) const noexcept {
  // After a missed period the device was right to hold or to go dark.
  if (!finite(command) || unwritten_ > 0) return InForce::kUnknown;
  const double due = wanted(limits);
  if (close_to(command, due)) return InForce::kAsWritten;
  // The power before, some of both, or a watchdog that had waited too long.
  const double before = limits.command_delay == 0 ? written_before_ : written_earlier_;
  const bool ours = command >= std::min(before, due) - kReadbackFloor &&
                    command <= std::max(before, due) + kReadbackFloor;
  return ours || command == 0.0 ? InForce::kLate : InForce::kForeign;
}

void PowerCheck::check(const Readback& readback, InForce command, DeviceStatus sample,
                       const SafetyLimits& limits, SafetyLatch& latch) noexcept {
  const bool told = finite(readback.command);
  if (!told && unwritten_ > 0) return;
  const bool silent = sample == DeviceStatus::kTimeout && !finite(readback.power);
  const auto reason = [&](SafetyReason wrong) {
    return silent ? SafetyReason::kSampleMissing : wrong;
  };
  // A device that reports its command is checked against that.
  const double expected = told ? readback.command : wanted(limits);
  const bool foreign = command == InForce::kForeign;
  if ((expected <= 0.0 && !(readback.power <= kReadbackFloor)) ||
      (foreign && wanted(limits) == 0.0)) {
    latch.safe_stop(reason(SafetyReason::kPowerStuckOn), true);
    return;
  }
  const bool differs = foreign || !close_to(readback.power, expected);
  // Without light there is nothing to compare: 0 W neither counts nor clears.
  if (differs) {
    ++readback_off_;
    latch.notice(reason(SafetyReason::kPowerReadback));
  } else if (expected > 0.0) {
    readback_off_ = 0;
  }
  if (readback_off_ > kReadbackOffMax) latch.safe_stop(reason(SafetyReason::kPowerReadback), true);
}

bool PowerCheck::known(const Readback& readback, const SafetyLimits& limits) const noexcept {
  return finite(readback.power) && readback.power >= 0.0 &&
         readback.power <= 2.0 * limits.power_max;
}

double PowerCheck::emitted(const Readback& readback, const SafetyLimits& limits) const noexcept {
  if (!known(readback, limits)) return written_;
  // Where the two differ too much the larger one counts: the peak must not be underestimated.
  return readback_off_ > 0 ? std::max(readback.power, written_) : readback.power;
}

void PowerCheck::check_excess(const Readback& readback, const MultiModelObserver& observer,
                              const SafetyLimits& limits, SafetyLatch& latch) const noexcept {
  if (readback_off_ == 0 || !known(readback, limits) || !(readback.power > written_)) return;
  if (readback.power > observer.power_for_peak(limits.peak_max / limits.hidden_gain())) {
    latch.safe_stop(SafetyReason::kPowerReadback, true);
  }
}

void PowerCheck::end_period(bool behind, const SafetyLimits& limits) noexcept {
  unwritten_ = behind ? 1 + limits.command_delay : std::max<std::int64_t>(0, unwritten_ - 1);
}

void PowerCheck::write(double power) noexcept {
  written_earlier_ = written_before_;
  written_before_ = written_;
  written_ = power;
}

double PowerCheck::on_its_way(const SafetyLimits& limits) const noexcept {
  return limits.command_delay == 0 ? 0.0 : written_ * (1.0 + limits.power_accuracy) * limits.period;
}

}  // namespace photocoag
