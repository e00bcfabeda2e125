#include "photocoag/photoacoustics/transducer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "photocoag/core/random.hpp"
#include "photocoag/photoacoustics/matched_filter.hpp"

namespace photocoag {

Transducer::Transducer(const TransducerSettings& settings) : arrival_(settings.arrival) {
  fine_.resize(kTransientSamples * kFine + 2);
  for (std::size_t i = 0; i < fine_.size(); ++i) {
    const double t = static_cast<double>(i) / kFine;
    fine_[i] = t / settings.decay * std::exp(1.0 - t / settings.decay) *
               std::sin(2.0 * std::numbers::pi * settings.frequency * t);
  }
  constexpr std::size_t kMargin = MatchedFilter::kMaxLag;
  constexpr std::size_t kCount = kTransientSamples - 2 * kMargin;
  double mean = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const double value = shape(static_cast<double>(kMargin + i) - arrival_);
    mean += value / kCount;
    squares += value * value;
  }
  gain_ = std::sqrt(squares - kCount * mean * mean);
}

double Transducer::shape(double t) const noexcept {
  if (t <= 0.0) return 0.0;
  const double fine = t * kFine;
  const auto i = static_cast<std::size_t>(fine);
  if (i + 1 >= fine_.size()) return 0.0;
  const double x = fine - static_cast<double>(i);
  return fine_[i] + x * (fine_[i + 1] - fine_[i]);
}

void Transducer::write(double amplitude, double delay, double noise, std::uint64_t seed,
                       std::uint64_t pulse, PressureTransient& transient) const noexcept {
  constexpr double kRail = kConverterRail;
  for (std::size_t i = 0; i < kTransientSamples; ++i) {
    double value = amplitude * shape(static_cast<double>(i) - arrival_ - delay);
    if (noise > 0.0) {
      value += noise *
               standard_normal(seed, pulse * kTransientSamples + i, RandomStream::kTransientNoise);
    }
    transient.codes[i] = static_cast<std::int16_t>(std::lrint(std::clamp(value, -kRail, kRail)));
  }
}

}  // namespace photocoag
