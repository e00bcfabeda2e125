// Role: online; one pressure transient as the converter delivers it. Used by photoacoustics, rt,
// eye. Source: docs/photoacoustics.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace photocoag {

inline constexpr std::size_t kTransientSamples = 128;
inline constexpr std::int16_t kConverterRail = 32767;  ///< codes at +- this are saturated

struct PressureTransient {
  std::array<std::int16_t, kTransientSamples> codes{};
  bool operator==(const PressureTransient&) const = default;
};

/// One pulse: its transient and the energy read by the laser's meter.
struct PulseReading {
  PressureTransient transient;
  double energy = 0.0;  ///< J
};

/// Defects of a pulse or of a sample made of pulses; bits.
enum PulseFlag : std::uint32_t {
  kPulseGood = 0,
  kPulseSaturated = 1U << 0U,
  kPulseNoArrival = 1U << 1U,         ///< no transient above the noise where it is expected
  kPulseEnergyOutOfRange = 1U << 2U,  ///< or not a number
  kSampleTooFewPulses = 1U << 3U,     ///< less than half of them were good
  kSampleOutsideCurve = 1U << 4U,     ///< the temperature is outside the curve's valid range
};

}  // namespace photocoag
