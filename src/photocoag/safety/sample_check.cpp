#include "photocoag/safety/sample_check.hpp"

#include <algorithm>

namespace photocoag {
namespace {

constexpr double kNsPerSecond = 1e9;

bool stale(const DeviceSample& sample, std::uint64_t expected, double period) noexcept {
  const auto period_ns = static_cast<std::int64_t>(period * kNsPerSecond);
  const std::int64_t age = sample.now_ns - sample.time_ns;
  return sample.sequence < expected || age > period_ns * 3 / 2 || age < -period_ns / 10;
}

}  // namespace

SafetyReason SampleCheck::check(const DeviceSample& sample, MultiModelObserver& observer,
                                const SafetyLimits& limits, SafetyLatch& latch) noexcept {
  ++expected_;
  if (sample.periods_behind > 0) {
    // The controller's overrun, counted by ClockCheck: not the device's fault.
    rejected_.add(false);
    return SafetyReason::kOverrun;
  }
  SafetyReason reason = SafetyReason::kNone;
  if (sample.status != DeviceStatus::kGood || !finite(sample.volume_temperature)) {
    reason = SafetyReason::kSampleMissing;
  } else if (sample.saturated) {
    reason = SafetyReason::kSampleSaturated;
  } else if (stale(sample, expected_, limits.period)) {
    reason = SafetyReason::kSampleStale;
  } else {
    const ObserverResidual residual = observer.compare(sample.volume_temperature);
    watch_noise(residual.outside, latch);
    const bool rejected = residual.outside > kRejectAt;
    if (rejected) reason = SafetyReason::kSampleRejected;
    observer.set_suspicious(rejected && residual.above);
  }
  // Stuck is judged on everything that looks like a sample.
  if (reason == SafetyReason::kNone || reason == SafetyReason::kSampleRejected) {
    same_raw_ = sample.raw == raw_ ? same_raw_ + 1 : 1;
    raw_ = sample.raw;
    expected_ = sample.sequence;
    if (same_raw_ >= kSameRawMax && limits.check_quiet != 0) {
      latch.safe_stop(SafetyReason::kSampleStuck);
      reason = SafetyReason::kSampleStuck;
    }
  }
  count(reason, latch);
  return reason;
}

void SampleCheck::count(SafetyReason reason, SafetyLatch& latch) noexcept {
  const bool missing =
      reason == SafetyReason::kSampleMissing || reason == SafetyReason::kSampleStale;
  missing_ = missing ? missing_ + 1 : 0;
  saturated_ = reason == SafetyReason::kSampleSaturated ? saturated_ + 1 : 0;
  rejected_.add(reason == SafetyReason::kSampleRejected);
  if (reason != SafetyReason::kNone) latch.notice(reason);
  if (missing_ > kMissingMax) latch.safe_stop(reason);
  if (saturated_ > kSaturatedMax) latch.safe_stop(reason);
  if (rejected_.among_last(20) > kRejectedMax) latch.safe_stop(SafetyReason::kSampleRejected);
}

void SampleCheck::watch_noise(double residual, SafetyLatch& latch) noexcept {
  residuals_.add(std::min(residual * residual, kResidualLimit));
  if (residuals_.sum() > kNoisiest) latch.safe_stop(SafetyReason::kMeasurementNoise);
}

}  // namespace photocoag
