// Role: simulation; counter-based random numbers: a value depends on (seed, cycle, stream) alone,
// not on earlier draws. Generator: Philox 4x32-10 of the Random123 library (Salmon et al.,
// "Parallel random numbers: as easy as 1, 2, 3", SC'11). Real time: noexcept, no allocation.
#pragma once

#include <cstdint>

namespace photocoag {

/// What a random number is for; each stream is independent of the others.
enum class RandomStream : std::uint32_t {
  kMeasurementNoise = 1,
  kOnOffPower = 2,
  kStudy = 3,
  kRandomSpot = 4,
  kTransientNoise = 5,
  kPulseEnergy = 6,
  kEnergyMeter = 7,
  kArrivalTime = 8,
  kUncertainFit = 9,
  kTest = 100
};

/// Uniform in (0, 1), 53 bits.
double uniform(std::uint64_t seed, std::uint64_t cycle, RandomStream stream) noexcept;

/// Standard normal (Box-Muller).
double standard_normal(std::uint64_t seed, std::uint64_t cycle, RandomStream stream) noexcept;

}  // namespace photocoag
