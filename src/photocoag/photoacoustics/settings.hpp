// Role: setup; the user's settings of the photoacoustic measurement. Used by the configuration,
// eye.
// Source: docs/photoacoustics.md. Units: SI.
#pragma once

#include <string>

namespace photocoag {

enum class Sampling {
  kInstant,  ///< a sample is the temperature at the end of its control period
  kPulses,   ///< a sample is the mean over the period's pulses, each just before its own heat
};

enum class PulseNoise {
  kTemperature,  ///< constant in K at every energy and temperature
  kVoltage,      ///< constant in volts: plant.noise_K holds at 2.6 uJ in cold tissue
};

enum class EyePacing {
  kAuto,      ///< the wall clock if eye and controller can keep up, else lockstep
  kWall,      ///< the wall clock
  kLockstep,  ///< the next pulse waits for the controller: real time is not measured
};

inline constexpr double kNoiseReferenceEnergy = 2.6e-6;  ///< J, reference of PulseNoise::kVoltage

struct PhotoacousticSettings {
  Sampling sampling = Sampling::kInstant;
  std::string calibration;      ///< TOML file of the curve; empty: water-like, not verified
  double pulse_period = 1e-4;   ///< s, 2e-5 to 0.01; a whole fraction of the control period
  int baseline_pulses = 2000;   ///< of cold tissue before a treatment; 16 to 100,000
  std::string eye_calibration;  ///< the simulated eye's true curve; empty: the same
  PulseNoise eye_noise = PulseNoise::kTemperature;
  EyePacing eye_pacing = EyePacing::kAuto;  ///< of the simulated eye; drivers ignore it
  bool operator==(const PhotoacousticSettings&) const = default;
};

}  // namespace photocoag
