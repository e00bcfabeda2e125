// Role: simulation; plant, measurement noise and the laser's own watchdog. Used by loop.
// Real time: noexcept, no allocation.
#pragma once

#include <cstdint>
#include <utility>

#include "photocoag/core/random.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/loop/plant.hpp"

namespace photocoag {

/// What the eye shows at the end of a period: the sample, and the truth that only a simulation
/// knows.
struct Reading {
  Sample sample;
  Outputs truth;
};

struct EyeSettings {
  int delay = 0;                ///< periods until a written power is emitted, 0 or 1
  bool dark_is_silent = false;  ///< a period without power gives no sample
  double sensor_gain = 1.0;     ///< 1: the calibration is right. The noise is not scaled by it
  double sensor_offset = 0.0;   ///< K
  double power_gain = 1.0;      ///< emitted per commanded power
  double power_lag = 0.0;       ///< of a period, as the plant's: what the mean over a period shows
  bool readback = true;         ///< false: the command is reported as applied
};

template <Plant P>
class SimulatedEye {
 public:
  /// noise: K, standard deviation of the sample; drawn from (seed, cycle) alone.
  SimulatedEye(P plant, double noise, std::uint64_t seed, EyeSettings settings = {})
      : plant_(std::move(plant)), noise_(noise), seed_(seed), settings_(settings) {}

  /// The laser's new power, W. Feeds its watchdog.
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
        settings_.sensor_gain * sampled(truth.volume) + settings_.sensor_offset + noise;
    return {.sample = {.volume_temperature = silent ? Sample{}.volume_temperature : seen,
                       .applied_power = settings_.readback ? emitted : commanded},
            .truth = truth};
  }

 private:
  // A plant may know what its sample shows instead of the temperature at the period's end.
  double sampled(double at_the_end) const noexcept {
    if constexpr (requires { plant_.sample(); }) {
      return plant_.sample();
    } else {
      return at_the_end;
    }
  }

  P plant_;
  double noise_;
  std::uint64_t seed_;
  EyeSettings settings_;
  double power_ = 0.0;
  double delayed_power_ = 0.0;  // written one period ago
  double acting_before_ = 0.0;
  int periods_since_write_ = 0;
};

}  // namespace photocoag
