// Role: simulation and setup; when within a period the power acts and the sample is taken. Used by
// the simulated eyes (fom, rom), the controller's model, estimation, run and config. Source:
// docs/equations.md (E29). Units: fractions of the control period. Real time: noexcept, no
// allocation.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace photocoag {

/// A power written for period n acts from power_lag after the period's start to power_lag after its
/// end. The sample of period n is the mean over a window of length `averaging` (0: the
/// instantaneous value) that ends sample_lag before the period's end. Each from 0 to 1.
struct IntersampleTiming {
  double averaging = 0.0;
  double sample_lag = 0.0;
  double power_lag = 0.0;

  /// Instant samples at the end of a period whose power acts at once.
  bool plain() const noexcept { return averaging == 0.0 && sample_lag == 0.0 && power_lag == 0.0; }
  bool operator==(const IntersampleTiming&) const = default;
};

/// A window within the time in which one power acts, as fractions of it; an instant if begin ==
/// end.
struct Window {
  double begin = 1.0;
  double end = 1.0;
};

/// How a sample spans the current and the two previous powers: it is sum_k share[k] * (mean volume
/// temperature over window[k] of power n - k).
struct SampleWindows {
  static constexpr int kMost = 3;
  std::array<double, kMost> share{};
  std::array<Window, kMost> window{};
};

/// With time counted from the moment a power begins to act, the period ends at 1 - power_lag and
/// the sample's window at 1 - power_lag - sample_lag.
inline SampleWindows sample_windows(const IntersampleTiming& timing) noexcept {
  const double end = 1.0 - timing.power_lag - timing.sample_lag;
  const double begin = end - timing.averaging;
  SampleWindows seen;
  for (int k = 0; k < SampleWindows::kMost; ++k) {
    if (timing.averaging == 0.0) {
      const bool here = end >= -k && (k == 0 || end < 1 - k);
      if (here) seen.share[k] = 1.0;
      if (here) seen.window[k] = {end + k, end + k};
      continue;
    }
    const Window part{std::max(begin + k, 0.0), std::min(end + k, 1.0)};
    if (part.end <= part.begin) continue;
    seen.share[k] = (part.end - part.begin) / timing.averaging;
    seen.window[k] = part;
  }
  return seen;
}

/// Mean over the window of exp(-x t), x = rate * period: the mean decay of a mode.
inline double mean_decay(double exponent, Window window) noexcept {
  const double left = std::exp(-exponent * window.begin);
  const double span = exponent * (window.end - window.begin);
  return span == 0.0 ? left : left * (-std::expm1(-span) / span);
}

/// Mean over the window of 1 - exp(-x t), x > 0: how close a mode is to its steady state.
inline double mean_rise(double exponent, Window window) noexcept {
  if (window.begin == window.end) return -std::expm1(-exponent * window.end);
  // (1 - mean decay) without cancellation where x is small: the mean of 1 - exp(-x t) over the
  // window is 1 - exp(-x a) plus exp(-x a) times the same over (0, b - a).
  const double span = exponent * (window.end - window.begin);
  const double rest = span < 1e-3 ? span * (0.5 - span * (1.0 / 6.0 - span / 24.0))
                                  : 1.0 + std::expm1(-span) / span;
  return -std::expm1(-exponent * window.begin) + std::exp(-exponent * window.begin) * rest;
}

/// The true alpha after `time`, s: first * (1 + drift * time), drift in 1/s, clamped to the range
/// that the configuration accepts.
inline double drifted_absorption(double first, double drift, double time) noexcept {
  return std::clamp(first * (1.0 + drift * time), 0.05, 5.0);
}

}  // namespace photocoag
