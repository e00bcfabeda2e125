// Role: online; the amplitude of a transient by correlation with a template, within a range of
// arrival times. Used by the thermometer. Source: docs/photoacoustics.md (P1) to (P3).
// Real time: match is noexcept, bounded, allocation-free.
#pragma once

#include <array>

#include "photocoag/photoacoustics/transient.hpp"

namespace photocoag {

struct Match {
  double amplitude = 0.0;  ///< in units of the template
  double lag = 0.0;        ///< samples later than the template
  double sigma = 0.0;      ///< of the amplitude, from the noise before the arrival
  bool arrived = false;    ///< a maximum inside the search range, above the noise
};

class MatchedFilter {
 public:
  using Template = std::array<double, kTransientSamples>;
  static constexpr int kMaxLag = 8;          ///< samples, either way
  static constexpr std::size_t kQuiet = 24;  ///< first samples, before any arrival

  /// The template must have zeros or noise in its first kQuiet samples and leave kMaxLag samples
  /// free at both ends. Its energy must not be 0: see usable().
  explicit MatchedFilter(const Template& shape) noexcept;
  bool usable() const noexcept { return energy_ > 0.0; }
  Match match(const PressureTransient& transient) const noexcept;

 private:
  static constexpr std::size_t kFirst = kMaxLag;
  static constexpr std::size_t kCount = kTransientSamples - 2 * kMaxLag;
  std::array<double, kCount> shape_{};  // mean removed: an offset of the converter cancels
  double energy_ = 0.0;                 // sum of squares
};

}  // namespace photocoag
