// Role: tests; pulses of a transducer of known amplitude law.
#pragma once

#include <vector>

#include "photocoag/core/random.hpp"
#include "photocoag/photoacoustics/thermometer.hpp"
#include "photocoag/photoacoustics/transducer.hpp"

namespace photocoag::testing {

/// Amplitude = codes_per_joule * energy * Gamma(T) / Gamma(22 deg C).
struct Source {
  GrueneisenCurve curve{water_like_curve()};
  Transducer transducer{};
  double codes_per_joule = 3000.0 / 2.6e-6;
  double noise = 0.0;   // codes per converter sample
  double jitter = 0.0;  // samples, standard deviation
  std::uint64_t seed = 1;
  std::uint64_t pulse = 0;

  PulseReading at(double rise, double energy = 2.6e-6) {
    PulseReading reading{.transient = {}, .energy = energy};
    const double gamma = curve.value(22.0 + rise) / curve.value(22.0);
    const double delay = jitter * standard_normal(seed, pulse, RandomStream::kTest);
    transducer.write(codes_per_joule * energy * gamma, delay, noise, seed, pulse,
                     reading.transient);
    ++pulse;
    return reading;
  }
  std::vector<PulseReading> cold(std::size_t count) {
    std::vector<PulseReading> readings;
    for (std::size_t i = 0; i < count; ++i) readings.push_back(at(0.0));
    return readings;
  }
};

}  // namespace photocoag::testing
