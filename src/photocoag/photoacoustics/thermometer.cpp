#include "photocoag/photoacoustics/thermometer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

bool at_rail(const PressureTransient& transient) noexcept {
  return std::any_of(transient.codes.begin(), transient.codes.end(), [](std::int16_t code) {
    return code >= kConverterRail || code <= -kConverterRail;
  });
}

std::uint32_t flags_before_match(const PulseReading& pulse,
                                 const ThermometerSettings& settings) noexcept {
  std::uint32_t flags = kPulseGood;
  if (at_rail(pulse.transient)) flags |= kPulseSaturated;
  // Also if it is not a number.
  if (!(pulse.energy >= settings.energy_min && pulse.energy <= settings.energy_max)) {
    flags |= kPulseEnergyOutOfRange;
  }
  return flags;
}

// Catmull-Rom between the converter's samples; 0 outside.
double at(const PressureTransient& transient, double position) noexcept {
  const double whole = std::floor(position);
  const double x = position - whole;
  const auto i = static_cast<std::ptrdiff_t>(whole);
  const auto code = [&](std::ptrdiff_t k) {
    return k < 0 || k >= static_cast<std::ptrdiff_t>(kTransientSamples)
               ? 0.0
               : static_cast<double>(transient.codes[static_cast<std::size_t>(k)]);
  };
  const double a = code(i - 1);
  const double b = code(i);
  const double c = code(i + 1);
  const double d = code(i + 2);
  return b +
         0.5 * x * (c - a + x * (2.0 * a - 5.0 * b + 4.0 * c - d + x * (3.0 * (b - c) + d - a)));
}

}  // namespace

Baseline measure_baseline(std::span<const PulseReading> pulses,
                          const ThermometerSettings& settings) {
  const auto refuse = [](std::string found) {
    throw Error(ErrorParts{.where = "photoacoustic baseline",
                           .problem = "the baseline of the cold tissue is not usable",
                           .found = std::move(found),
                           .accepted = "at least 8 good pulses, and half of all"});
  };
  const auto usable = [&](const PulseReading& pulse) {
    return flags_before_match(pulse, settings) == kPulseGood;
  };
  const auto first = std::find_if(pulses.begin(), pulses.end(), usable);
  if (first == pulses.end()) refuse(fmt::format("none good of {} pulses", pulses.size()));
  Baseline baseline;
  for (std::size_t i = 0; i < kTransientSamples; ++i) {
    baseline.shape[i] = static_cast<double>(first->transient.codes[i]);
  }
  for (int pass = 0; pass < 2; ++pass) {
    const MatchedFilter filter(baseline.shape);
    if (!filter.usable()) refuse("a first transient that is flat");
    MatchedFilter::Template sum{};
    std::size_t count = 0;
    for (const PulseReading& pulse : pulses) {
      if (!usable(pulse)) continue;
      const Match match = filter.match(pulse.transient);
      if (!match.arrived) continue;
      for (std::size_t i = 0; i < kTransientSamples; ++i) {
        sum[i] += at(pulse.transient, static_cast<double>(i) + match.lag);
      }
      ++count;
    }
    if (count < 8 || 2 * count < pulses.size()) {
      refuse(fmt::format("{} good of {} pulses", count, pulses.size()));
    }
    for (std::size_t i = 0; i < kTransientSamples; ++i) {
      baseline.shape[i] = sum[i] / static_cast<double>(count);
    }
  }
  const MatchedFilter filter(baseline.shape);
  double sum = 0.0;
  double squares = 0.0;
  for (const PulseReading& pulse : pulses) {
    if (!usable(pulse)) continue;
    const Match match = filter.match(pulse.transient);
    if (!match.arrived) continue;
    const double q = match.amplitude / pulse.energy;
    sum += q;
    squares += q * q;
    ++baseline.pulses;
  }
  const auto count = static_cast<double>(baseline.pulses);
  if (baseline.pulses < 8) refuse(fmt::format("{} good of {} pulses", count, pulses.size()));
  baseline.per_energy = sum / count;
  const double variance = squares / count - baseline.per_energy * baseline.per_energy;
  baseline.scatter = std::sqrt(std::max(0.0, variance)) / baseline.per_energy;
  return baseline;
}

PulseThermometer::PulseThermometer(const Baseline& baseline, const GrueneisenCurve& curve,
                                   const ThermometerSettings& settings)
    : filter_(baseline.shape),
      curve_(curve),
      settings_(settings),
      baseline_(baseline.per_energy),
      cold_(curve.value(settings.ambient_celsius)) {
  if (!filter_.usable() || !(baseline_ > 0.0)) {
    throw Error(ErrorParts{.where = "photoacoustic baseline", .problem = "it is empty"});
  }
  if (!(settings.ambient_celsius > curve.low() && settings.ambient_celsius < curve.high())) {
    throw Error(ErrorParts{.key = "tissue.ambient_C",
                           .problem = "the calibration curve does not hold there",
                           .found = fmt::format("{} deg C", settings.ambient_celsius),
                           .accepted = fmt::format("{} to {} deg C", curve.low(), curve.high())});
  }
}

PulseResult PulseThermometer::add(const PulseReading& pulse) noexcept {
  PulseResult result;
  result.flags = flags_before_match(pulse, settings_);
  ++all_;
  if ((result.flags & kPulseSaturated) != 0) ++saturated_;
  if (result.flags == kPulseGood) {
    const Match match = filter_.match(pulse.transient);
    result.lag = match.lag;
    result.per_energy = match.amplitude / pulse.energy / baseline_;  // (P4)
    if (!match.arrived) result.flags |= kPulseNoArrival;
  }
  flags_ |= result.flags;
  if (result.flags == kPulseGood) {
    sum_ += result.per_energy;
    ++good_;
  }
  return result;
}

ThermometerSample PulseThermometer::finish() noexcept {
  ThermometerSample sample{.volume_temperature = std::numeric_limits<double>::quiet_NaN(),
                           .pulses = good_,
                           .saturated = saturated_,
                           .flags = flags_};
  if (good_ == 0 || 2 * good_ < all_) {
    sample.flags |= kSampleTooFewPulses;
  } else {
    // (P5): the mean first, then the curve, so that noise is not bent by it.
    const double celsius = curve_.temperature(sum_ / good_ * cold_);
    if (!std::isfinite(celsius)) sample.flags |= kSampleOutsideCurve;
    sample.volume_temperature = celsius - settings_.ambient_celsius;
  }
  sum_ = 0.0;
  good_ = all_ = saturated_ = 0;
  flags_ = kPulseGood;
  return sample;
}

double predicted_noise(const Baseline& baseline, const GrueneisenCurve& curve,
                       const ThermometerSettings& settings, double noise_codes, double energy,
                       double celsius, int pulses) {
  const std::size_t margin = MatchedFilter::kMaxLag;
  const std::size_t count = kTransientSamples - 2 * margin;
  double mean = 0.0;
  for (std::size_t i = 0; i < count; ++i) mean += baseline.shape[margin + i];
  mean /= static_cast<double>(count);
  double energy_of_shape = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    energy_of_shape += (baseline.shape[margin + i] - mean) * (baseline.shape[margin + i] - mean);
  }
  const double amplitude = noise_codes / std::sqrt(energy_of_shape);
  const double ratio = amplitude / energy / baseline.per_energy;
  return ratio * curve.value(settings.ambient_celsius) / curve.slope(celsius) /
         std::sqrt(static_cast<double>(pulses));
}

}  // namespace photocoag
