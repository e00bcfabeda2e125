#include "photocoag/run/device_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photocoag/run/calibration_file.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {

SafetyLimits device_limits(const Config& config) {
  SafetyLimits limits = safety_limits(config);
  // A device holds its power when a write is missed, with any scheduling.
  limits.command_held = 1;
  const bool eye = config.photoacoustics.sampling == Sampling::kPulses;
  if (eye && config.safety.real_time == RealTimeMode::kObserve) {
    limits.overruns_in_a_row_max = std::max(
        limits.overruns_in_a_row_max, static_cast<std::int64_t>(kEyeStall / config.control.period));
  }
  // All samples share the zero point of the baseline, which has its own noise.
  if (eye) {
    limits.zero_error = limits.noise * std::sqrt(static_cast<double>(pulses_per_period(config)) /
                                                 config.photoacoustics.baseline_pulses);
  }
  return limits;
}

ObserverModel device_observer(const Config& config, int pulses) {
  return observer_model(config.tissue, config.estimator, config.control.period,
                        Discretization::kZeroOrderHold, config.control.power_max, pulses);
}

int pulses_per_period(const Config& config) {
  const double ratio = config.control.period / config.photoacoustics.pulse_period;
  const double whole = std::round(ratio);
  if (whole < 1.0 || std::abs(ratio - whole) > 1e-6) {
    throw Error(ErrorParts{.key = "photoacoustics.pulse_period_ms",
                           .found = fmt::format("{}", config.photoacoustics.pulse_period * 1e3),
                           .accepted = fmt::format("a whole fraction of control.period_ms = {}",
                                                   config.control.period * 1e3)});
  }
  return static_cast<int>(whole);
}

void require_plausible(const GrueneisenCurve& curve, const Config& config) {
  // Relative rise per K. Water-like 4.7 % at 20 deg C, 2.6 % at 37: a curve in other units (mK, or
  // kelvin instead of deg C) is far outside.
  constexpr double kLeast = 0.003;
  constexpr double kMost = 0.15;
  const std::string& file = config.photoacoustics.calibration;
  const double cold = config.tissue.ambient_celsius;
  const double hot = cold + config.control.peak_max;
  if (curve.low() > cold || curve.high() < hot) {
    throw Error(ErrorParts{.where = file,
                           .key = "curve.valid_C",
                           .problem = "the treatment leaves the calibrated range",
                           .found = fmt::format("[{:g}, {:g}]", curve.low(), curve.high()),
                           .accepted = fmt::format("from tissue.ambient_C to that plus "
                                                   "control.peak_max_K: {:g} to {:g} deg C",
                                                   cold, hot)});
  }
  const double rise = curve.slope(cold) / curve.value(cold);
  if (!(rise >= kLeast && rise <= kMost)) {
    throw Error(
        ErrorParts{.where = file,
                   .key = "curve",
                   .problem = "not a curve of tissue",
                   .found = fmt::format("{:.3g} % per K at {:g} deg C", 100 * rise, cold),
                   .accepted = fmt::format("{:g} to {:g} % per K", 100 * kLeast, 100 * kMost)});
  }
}

Config for_device(Config config, const DeviceAddress& device) {
  if (device.here()) return config;
  if (config.control.solver != SolverKind::kDense) {
    throw Error(ErrorParts{.key = "control.solver",
                           .problem = "a device needs the solver that is real-time safe",
                           .accepted = "\"dense\""});
  }
  if (!device.eye()) return config;
  if (config.photoacoustics.eye_pacing == EyePacing::kLockstep &&
      config.safety.real_time == RealTimeMode::kEnforce) {
    throw Error(ErrorParts{.key = "photoacoustics.eye_pacing",
                           .problem = "in lockstep there is no real time to enforce",
                           .found = "lockstep",
                           .accepted = "\"auto\" or \"wall\" with safety.real_time = \"enforce\""});
  }
  // Trigger jitter, energy meter and converter leave 0.016 K.
  constexpr double kQuietestPulses = 0.02;
  if (config.plant.noise < kQuietestPulses) {
    throw Error(ErrorParts{.key = "plant.noise_K",
                           .problem = "pulses are noisier than that",
                           .found = fmt::format("{:g}", config.plant.noise),
                           .accepted = fmt::format("from {:g} K", kQuietestPulses)});
  }
  pulses_per_period(config);
  require_plausible(GrueneisenCurve(load_curve(config.photoacoustics.calibration)), config);
  config.tissue.volume_temperature = VolumeTemperature::kNormalized;
  config.plant.tissue.volume_temperature = VolumeTemperature::kNormalized;
  config.plant.model = PlantModel::kFull;
  config.photoacoustics.sampling = Sampling::kPulses;
  return config;
}

}  // namespace photocoag
