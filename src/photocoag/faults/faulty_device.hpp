// Role: safety tests; a device with injected faults, and a record of what it really emitted. Used
// by fault_table. Shares only the device interface with the supervisor.
// Real time: noexcept, no allocation after construction.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "photocoag/device/device.hpp"
#include "photocoag/faults/injection.hpp"

namespace photocoag {

/// Ground truth for judging a trial.
struct TrialRecord {
  static constexpr std::int64_t kNever = -1;
  std::int64_t visible = kNever;         ///< first cycle whose data or answer was bad
  std::int64_t interlock_call = kNever;  ///< cycle in which safe_off was called first
  std::vector<double> emitted;           ///< W, per cycle
  /// Periods with light after the cycle of the first bad datum; 0: off at the write of that cycle.
  int light_after_visible() const noexcept {
    const auto first = static_cast<std::size_t>(visible + 1);
    int periods = 0;
    for (std::size_t k = first; k < emitted.size(); ++k) periods += emitted[k] > 0.0 ? 1 : 0;
    return periods;
  }
};

/// Sits between loop and device: a 16-bit converter from -50 to 300 K, and the fault.
template <Device D>
class FaultyDevice {
 public:
  FaultyDevice(D& device, const Injection& injection, TrialRecord& trial, std::size_t cycles)
      : device_(device), injection_(injection), trial_(trial) {
    trial_.emitted.reserve(cycles);
  }

  DeviceSample wait_sample(std::uint64_t cycle) noexcept {
    cycle_ = cycle;
    DeviceSample sample = device_.wait_sample(cycle);
    elapsed_ms_ = 1e-6 * static_cast<double>(sample.now_ns);
    if (trial_.emitted.size() < trial_.emitted.capacity()) {
      trial_.emitted.push_back(device_.readback().power);
    }
    convert(sample);
    const DeviceSample unaltered = sample;
    if (injection_.active(cycle)) inject(sample);
    const bool repeats = injection_.fault == Fault::kSameSequence && injection_.active(cycle);
    if (!repeats) previous_ = unaltered;
    return sample;
  }

  Readback readback() noexcept {
    Readback readback = device_.readback();
    switch (active() ? injection_.fault : Fault::kNone) {
      case Fault::kReadback:
        readback.power *= injection_.value;
        see();
        break;
      case Fault::kGains:
        readback.power *= grown(injection_.readback) / laser_;
        break;
      case Fault::kShutter:
        readback.shutter_open = false;
        see();
        break;
      case Fault::kInterlock:
        readback.interlock_closed = false;
        see();
        break;
      case Fault::kFootSwitch:
        readback.foot_switch = false;
        see();
        break;
      case Fault::kGone:
        readback.power = std::numeric_limits<double>::quiet_NaN();
        break;
      default:
        break;
    }
    if (stuck_ && readback.power == injection_.value) see();
    if (off_ && readback.power == wrong_) see();
    return readback;
  }

  DeviceStatus write_power(double power, std::uint64_t token) noexcept {
    if (active() && injection_.fault == Fault::kWriteFails) {
      see();
      return DeviceStatus::kTimeout;
    }
    if (active() && injection_.fault == Fault::kGone) return DeviceStatus::kGone;
    stuck_ = active() && injection_.fault == Fault::kStuckOn && power == 0.0;
    off_ = active() && (injection_.fault == Fault::kLaser || injection_.fault == Fault::kLaserAt);
    wrong_ = injection_.fault == Fault::kLaser ? injection_.value * power : injection_.value;
    if (off_ && !dark_) return device_.write_power(wrong_, token);
    laser_ = injection_.fault == Fault::kGains ? grown(injection_.laser) : 1.0;
    return device_.write_power(stuck_ ? injection_.value : laser_ * power, token);
  }

  void heartbeat(std::uint64_t cycle) noexcept { device_.heartbeat(cycle); }

  void safe_off() noexcept {
    if (trial_.interlock_call == TrialRecord::kNever) {
      trial_.interlock_call = static_cast<std::int64_t>(cycle_);
    }
    if (active() && injection_.fault == Fault::kGone) return;
    dark_ = true;
    device_.safe_off();
  }

  auto truth() const noexcept { return device_.truth(); }

 private:
  static constexpr double kStep = 350.0 / 65536.0;  // K
  bool active() const noexcept { return injection_.active(cycle_); }
  void see() noexcept {
    if (trial_.visible == TrialRecord::kNever) trial_.visible = static_cast<std::int64_t>(cycle_);
  }
  // Current value of a factor during its ramp.
  double grown(double factor) const noexcept {
    if (elapsed_ms_ >= injection_.ramp_ms) return factor;
    return 1.0 + (factor - 1.0) * elapsed_ms_ / injection_.ramp_ms;
  }
  static void convert(DeviceSample& sample) noexcept {
    if (!std::isfinite(sample.volume_temperature)) return;
    const double inside = std::clamp(sample.volume_temperature, -50.0, 300.0);
    sample.raw = std::lround(inside / kStep);
    sample.volume_temperature = static_cast<double>(sample.raw) * kStep;
  }

  void inject(DeviceSample& sample) noexcept {
    double& value = sample.volume_temperature;
    const auto as_value = [&](double replacement) {
      value = replacement;
      see();
    };
    switch (injection_.fault) {
      case Fault::kMissing:
        sample.status = DeviceStatus::kTimeout;
        return as_value(std::numeric_limits<double>::quiet_NaN());
      case Fault::kGone:
        sample.status = DeviceStatus::kGone;
        return as_value(std::numeric_limits<double>::quiet_NaN());
      case Fault::kSameSequence:
      case Fault::kLateByOne: {
        const std::int64_t now = sample.now_ns;
        sample = previous_;
        sample.now_ns = now;
        return see();
      }
      case Fault::kOld:
        sample.time_ns =
            sample.now_ns - 2 * (sample.now_ns / static_cast<std::int64_t>(cycle_ + 1));
        return see();
      case Fault::kFuture:
        sample.time_ns += 3'600'000'000'000;
        return see();
      case Fault::kStuck:
        if (trial_.visible == TrialRecord::kNever) frozen_ = sample;
        sample.raw = frozen_.raw;
        return as_value(frozen_.volume_temperature);
      case Fault::kNotANumber:
        return as_value(std::numeric_limits<double>::quiet_NaN());
      case Fault::kInfinite:
        return as_value(std::numeric_limits<double>::infinity());
      case Fault::kNegativeZero:
        return as_value(-0.0);
      case Fault::kDenormal:
        return as_value(std::numeric_limits<double>::denorm_min());
      case Fault::kRail:
        sample.saturated = true;
        return as_value(300.0);
      case Fault::kSpike:
      case Fault::kBias:
        as_value(value + injection_.value);
        return convert(sample);
      case Fault::kNoise: {
        const double truth = device_.truth().volume;
        as_value(truth + injection_.value * (value - truth));
        return convert(sample);
      }
      case Fault::kGains:
        as_value(value * grown(injection_.samples));
        return convert(sample);
      case Fault::kJump:
      case Fault::kDrift:
      case Fault::kLag:
        return see();
      case Fault::kGain:
        as_value(value * injection_.value);
        return convert(sample);
      default:
        return;
    }
  }

  D& device_;
  Injection injection_;
  TrialRecord& trial_;
  std::uint64_t cycle_ = 0;
  DeviceSample previous_;
  DeviceSample frozen_;
  bool stuck_ = false;
  bool off_ = false;   // the last write was emitted as wrong_, W
  bool dark_ = false;  // the interlock is open
  double wrong_ = 0.0;
  double elapsed_ms_ = 0.0;
  double laser_ = 1.0;  // emitted per written power, last write
};

}  // namespace photocoag
