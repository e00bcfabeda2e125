// Role: online; converts pulses to temperatures: amplitude, energy, baseline, curve, average. Used
// by rt, run. Source: docs/photoacoustics.md (P1) to (P6). Units: SI; rises over ambient. Real
// time: PulseThermometer is noexcept, bounded, allocation-free; measure_baseline is setup. Threads:
// one owner.
#pragma once

#include <span>

#include "photocoag/photoacoustics/curve.hpp"
#include "photocoag/photoacoustics/matched_filter.hpp"
#include "photocoag/photoacoustics/transient.hpp"

namespace photocoag {

struct ThermometerSettings {
  double ambient_celsius = 22.0;  ///< of the baseline
  double energy_min = 0.05e-6;    ///< J; pulses outside are not used
  double energy_max = 100e-6;     ///< J
};

/// Response of cold tissue.
struct Baseline {
  MatchedFilter::Template shape{};  ///< mean transient, aligned
  double per_energy = 0.0;          ///< q_0: mean amplitude / energy, 1/J
  double scatter = 0.0;             ///< relative standard deviation of q
  std::size_t pulses = 0;           ///< good ones
};

/// Aligns and averages transients of cold tissue: first to the first good one, then to that mean.
/// Throws Error if less than half of them, or fewer than 8, are good. Allocates.
Baseline measure_baseline(std::span<const PulseReading> pulses,
                          const ThermometerSettings& settings);

struct PulseResult {
  double per_energy = 0.0;  ///< amplitude / energy relative to the baseline, r
  double lag = 0.0;         ///< samples
  std::uint32_t flags = kPulseGood;
};

struct ThermometerSample {
  double volume_temperature = 0.0;   ///< K, normalised mean; NaN if not usable
  int pulses = 0;                    ///< number used
  int saturated = 0;                 ///< number rejected as saturated
  std::uint32_t flags = kPulseGood;  ///< all flags of all pulses, and those of the sample
};

class PulseThermometer {
 public:
  /// Throws Error if the baseline or the ambient temperature do not fit the curve.
  PulseThermometer(const Baseline& baseline, const GrueneisenCurve& curve,
                   const ThermometerSettings& settings);

  /// One pulse of the current control sample.
  PulseResult add(const PulseReading& pulse) noexcept;
  /// The mean over the good pulses since the last call; starts the next sample.
  ThermometerSample finish() noexcept;

 private:
  MatchedFilter filter_;
  GrueneisenCurve curve_;
  ThermometerSettings settings_;
  double baseline_;  // q_0
  double cold_;      // Gamma(T_0)
  double sum_ = 0.0;
  int good_ = 0;
  int all_ = 0;
  int saturated_ = 0;
  std::uint32_t flags_ = kPulseGood;
};

/// Standard deviation of a control sample, K, that noise of `noise_codes` per converter sample
/// causes at `energy` per pulse and `celsius`, averaged over `pulses`: (P6).
double predicted_noise(const Baseline& baseline, const GrueneisenCurve& curve,
                       const ThermometerSettings& settings, double noise_codes, double energy,
                       double celsius, int pulses);

}  // namespace photocoag
