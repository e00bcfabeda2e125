// Role: simulation; the simulated eye of a configuration: time stepping of its tissue, and how it
// measures. Used by run, fmu, python.
#pragma once

#include <memory>

#include "photocoag/config/config.hpp"
#include "photocoag/fom/intersample_plant.hpp"
#include "photocoag/fom/stepper.hpp"
#include "photocoag/loop/plant.hpp"
#include "photocoag/loop/simulated_eye.hpp"
#include "photocoag/rom/intersample.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// Delay, readback and the errors of laser and sensor.
inline EyeSettings eye_settings(const Config& config, const PlantMismatch& mismatch = {}) {
  const BenchSettings& bench = config.plant.bench;
  return {.delay = mismatch.delay.value_or(config.control.delay),
          .dark_is_silent = config.plant.zero_power_sample == ZeroPowerSample::kMissing,
          .sensor_gain = bench.sample_gain * mismatch.sensor_gain,
          .sensor_offset = bench.sample_offset + mismatch.sensor_offset,
          .power_gain = bench.power_gain,
          .power_lag = bench.timing.power_lag,
          .readback = bench.readback == PowerReadback::kEmitted};
}

/// Calls use(plant) with the cold tissue of [plant]: the full-order model if there is one, else the
/// reduced one.
template <typename Use>
auto with_plant(const Config& config, const std::shared_ptr<const FullOrderModel>& full,
                const ReducedModel* reduced, Use use) {
  const PlantSettings& plant = config.plant;
  const BenchSettings& bench = plant.bench;
  const double period = config.control.period;
  if (bench.needs_intersample() && full) {
    return use(
        IntersamplePlant(full, period, plant.absorption(), bench.timing, bench.absorption_drift));
  }
  if (bench.needs_intersample()) {
    return use(ReducedIntersamplePlant(*reduced, plant.absorption(), bench.timing,
                                       bench.absorption_drift));
  }
  if (full) {
    return use(FullOrderPlant(full, plant.discretization, period, plant.absorption()));
  }
  return use(ReducedPlant(*reduced, plant.absorption()));
}

}  // namespace photocoag
