#include "photocoag/photoacoustics/matched_filter.hpp"

#include <cmath>

namespace photocoag {

MatchedFilter::MatchedFilter(const Template& shape) noexcept {
  double mean = 0.0;
  for (std::size_t i = 0; i < kCount; ++i) mean += shape[kFirst + i];
  mean /= static_cast<double>(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    shape_[i] = shape[kFirst + i] - mean;
    energy_ += shape_[i] * shape_[i];
  }
}

Match MatchedFilter::match(const PressureTransient& transient) const noexcept {
  // (P1) at every whole lag.
  std::array<double, 2 * kMaxLag + 1> correlation{};
  std::array<double, kTransientSamples> signal{};
  for (std::size_t i = 0; i < kTransientSamples; ++i) {
    signal[i] = static_cast<double>(transient.codes[i]);
  }
  std::size_t best = 0;
  for (std::size_t lag = 0; lag < correlation.size(); ++lag) {
    double sum = 0.0;
    for (std::size_t i = 0; i < kCount; ++i) sum += signal[lag + i] * shape_[i];
    correlation[lag] = sum / energy_;
    if (correlation[lag] > correlation[best]) best = lag;
  }
  Match match;
  double mean = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < kQuiet; ++i) mean += signal[i];
  mean /= static_cast<double>(kQuiet);
  for (std::size_t i = 0; i < kQuiet; ++i) squares += (signal[i] - mean) * (signal[i] - mean);
  const double variance = squares / (static_cast<double>(kQuiet - 1) * energy_);
  match.sigma = std::sqrt(variance);
  if (best == 0 || best + 1 == correlation.size()) return match;  // no maximum: nothing arrived
  // (P2) the parabola through the maximum and its neighbours.
  const double left = correlation[best - 1];
  const double middle = correlation[best];
  const double right = correlation[best + 1];
  const double bend = left - 2.0 * middle + right;
  const double shift = bend < 0.0 ? 0.5 * (left - right) / bend : 0.0;
  const double top = middle - 0.25 * (left - right) * shift;
  match.lag = static_cast<double>(best) - kMaxLag + shift;
  // (P3) the search for the largest value adds variance / (2 A) on average.
  match.amplitude = top > 0.0 ? top - 0.5 * variance / top : top;
  // The residual must be noise, or small: another echo is no arrival.
  double total = 0.0;
  double window_sum = 0.0;
  for (std::size_t i = 0; i < kCount; ++i) {
    window_sum += signal[best + i];
    total += signal[best + i] * signal[best + i];
  }
  total -= window_sum * window_sum / static_cast<double>(kCount);
  const double explained = middle * middle * energy_;
  const double noise = static_cast<double>(kCount) * variance * energy_;
  constexpr double kAboveNoise = 5.0;
  match.arrived = match.amplitude > kAboveNoise * match.sigma &&
                  total - explained <= 4.0 * noise + 0.25 * explained;
  return match;
}

}  // namespace photocoag
