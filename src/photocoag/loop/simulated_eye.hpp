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

template <Plant P>
class SimulatedEye {
 public:
  /// noise: K, standard deviation of the sample; drawn from (seed, cycle) alone.
  SimulatedEye(P plant, double noise, std::uint64_t seed)
      : plant_(std::move(plant)), noise_(noise), seed_(seed) {}

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
    plant_.step(power_);
    const Outputs truth = plant_.outputs();
    const double noise = noise_ * standard_normal(seed_, cycle, RandomStream::kMeasurementNoise);
    return {.sample = {.volume_temperature = truth.volume + noise, .applied_power = power_},
            .truth = truth};
  }

 private:
  P plant_;
  double noise_;
  std::uint64_t seed_;
  double power_ = 0.0;
  int periods_since_write_ = 0;
};

}  // namespace photocoag
