// Role: simulation; plant, measurement noise, the laser's watchdog and a clock: a Device in virtual
// or wall time, or stepped by hand. Used by run, study, fmu, fault_table, tests.
// Real time: noexcept, no allocation; waits in wait_sample by design.
#pragma once

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "photocoag/core/random.hpp"
#include "photocoag/device/device.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/plant.hpp"

namespace photocoag {

/// Sample at the end of a period, and the truth that only a simulation knows.
struct Reading {
  Sample sample;
  Outputs truth;
};

struct EyeSettings {
  int delay = 0;                ///< periods until a written power is emitted, 0 or 1
  bool dark_is_silent = false;  ///< true: a period without power gives no sample
  double sensor_gain = 1.0;     ///< measured over true volume temperature; does not scale the noise
  double sensor_offset = 0.0;   ///< K
  double power_gain = 1.0;      ///< emitted over commanded power
  double power_lag = 0.0;  ///< fraction of a period, as the plant's; enters the reported mean power
  bool readback = true;    ///< false: the command is reported as applied
};

/// Waits for the end of cycle k = 0, 1, …; returns the number of further whole periods that have
/// passed.
template <typename C>
concept Pace = requires(C pace, const C& constant, std::size_t cycle) {
  { pace.wait_for_end_of(cycle) }
  noexcept->std::same_as<std::size_t>;
  { constant.deadline_ns(cycle) }
  noexcept->std::same_as<std::int64_t>;  // that end
};

/// Does not wait.
class VirtualPace {
 public:
  /// `period`: s; 0: all time stamps are 0, for an eye stepped by hand.
  explicit VirtualPace(double period = 0.0)
      : period_ns_(static_cast<std::int64_t>(period * 1e9 + 0.5)) {}
  std::size_t wait_for_end_of(std::size_t) noexcept { return 0; }
  std::int64_t deadline_ns(std::size_t cycle) const noexcept {
    return static_cast<std::int64_t>(cycle + 1) * period_ns_;
  }

 private:
  std::int64_t period_ns_;
};

/// After a late wake-up the missed periods are delivered one by one (periods_behind counts down);
/// only the last one's sample is valid.
template <Plant P, Pace C = VirtualPace>
class SimulatedEye {
 public:
  /// noise: K, standard deviation of the sample; drawn from (seed, cycle) alone.
  SimulatedEye(P plant, double noise, std::uint64_t seed, EyeSettings settings = {}, C pace = C())
      : plant_(std::move(plant)),
        noise_(noise),
        seed_(seed),
        settings_(settings),
        pace_(std::move(pace)) {}

  /// Sets the laser's power, W, and feeds its watchdog.
  void write(double power) noexcept {
    power_ = power;
    periods_since_write_ = 0;
  }

  /// One period passes. Without a fresh command the laser holds its power for one more period, then
  /// emits nothing (watchdog of two periods).
  Reading advance(std::uint64_t cycle) noexcept {
    if (periods_since_write_ >= 2) power_ = 0.0;
    ++periods_since_write_;
    const double commanded = settings_.delay == 0 ? power_ : delayed_power_;
    delayed_power_ = power_;
    const double acting = settings_.power_gain * commanded;
    // Mean over the period: some of it is still the power before.
    const double emitted = acting + settings_.power_lag * (acting_before_ - acting);
    acting_before_ = acting;
    plant_.step(acting);
    const Outputs truth = plant_.outputs();
    const double noise = noise_ * standard_normal(seed_, cycle, RandomStream::kMeasurementNoise);
    const bool silent = settings_.dark_is_silent && emitted == 0.0;
    const double seen =
        settings_.sensor_gain * sample_of(plant_, truth.volume) + settings_.sensor_offset + noise;
    return {.sample = {.volume_temperature = silent ? Sample{}.volume_temperature : seen,
                       .applied_power = settings_.readback ? emitted : commanded},
            .truth = truth};
  }

  DeviceSample wait_sample(std::uint64_t number) noexcept {
    const auto cycle = static_cast<std::size_t>(number);
    if (behind_ == 0) {
      // Saturates at the counter's maximum.
      behind_ = static_cast<std::uint32_t>(
          std::min<std::size_t>(pace_.wait_for_end_of(cycle), UINT32_MAX));
    } else {
      --behind_;
    }
    reading_ = advance(number);
    DeviceSample sample;
    sample.status = DeviceStatus::kGood;
    sample.periods_behind = behind_;
    if (behind_ == 0) sample.volume_temperature = reading_.sample.volume_temperature;
    sample.raw = std::bit_cast<std::int64_t>(reading_.sample.volume_temperature);
    sample.sequence = number + 1;
    sample.time_ns = pace_.deadline_ns(cycle);
    if constexpr (requires { pace_.woke_ns(); }) {  // real time: now
      sample.now_ns = pace_.woke_ns();
    } else {
      sample.now_ns = pace_.deadline_ns(cycle + behind_);
    }
    return sample;
  }
  Readback readback() noexcept {
    return {.power = reading_.sample.applied_power,
            .interlock_closed = !off_,
            .shutter_open = true,
            .foot_switch = true};
  }
  DeviceStatus write_power(double power, std::uint64_t) noexcept {
    write(off_ ? 0.0 : power);
    return DeviceStatus::kGood;
  }
  void heartbeat(std::uint64_t) noexcept {}
  void safe_off() noexcept {
    off_ = true;
    write(0.0);
  }
  /// True outputs at the end of the period that was fetched last.
  Outputs truth() const noexcept { return reading_.truth; }
  C& pace() noexcept { return pace_; }

 private:
  P plant_;
  double noise_;
  std::uint64_t seed_;
  EyeSettings settings_;
  C pace_;
  std::uint32_t behind_ = 0;
  bool off_ = false;
  Reading reading_;
  double power_ = 0.0;
  double delayed_power_ = 0.0;  // written one period ago
  double acting_before_ = 0.0;
  int periods_since_write_ = 0;
};

}  // namespace photocoag
