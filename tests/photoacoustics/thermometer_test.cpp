// Transient to temperature: exact where nothing disturbs, unbiased and as noisy as predicted where
// noise does, and a flag for each thing that makes a pulse useless.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "photoacoustics/pulses.hpp"
#include "photocoag/core/error.hpp"
#include "support/heap_guard.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

TEST(MatchedFilter, FindsAmplitudeAndArrivalOfAPureTransient) {
  const Transducer transducer;
  PressureTransient shape;
  transducer.write(10000.0, 0.0, 0.0, 1, 0, shape);
  MatchedFilter::Template mean{};
  for (std::size_t i = 0; i < kTransientSamples; ++i) mean[i] = shape.codes[i];
  const MatchedFilter filter(mean);
  for (const double delay : {-6.3, -2.5, -0.5, 0.0, 0.25, 1.0, 5.75}) {
    PressureTransient late;
    transducer.write(20000.0, delay, 0.0, 1, 0, late);
    const Match match = filter.match(late);
    EXPECT_TRUE(match.arrived);
    // Codes are rounded by up to 0.5 in 20000; half-way between two samples the parabola misses the
    // top of a cosine of 0.25 rad per sample by 1e-4, of the sharper onset by somewhat more.
    EXPECT_NEAR(match.amplitude, 2.0, delay == std::round(delay) ? 5e-5 : 5e-4) << delay;
    EXPECT_NEAR(match.lag, delay, 0.02) << delay;
  }
}

TEST(MatchedFilter, AnOffsetOfTheConverterChangesNothing) {
  const Transducer transducer;
  PressureTransient shape;
  transducer.write(10000.0, 0.0, 0.0, 1, 0, shape);
  MatchedFilter::Template mean{};
  for (std::size_t i = 0; i < kTransientSamples; ++i) mean[i] = shape.codes[i];
  PressureTransient shifted = shape;
  for (auto& code : shifted.codes) code = static_cast<std::int16_t>(code + 400);
  const MatchedFilter filter(mean);
  EXPECT_NEAR(filter.match(shifted).amplitude, filter.match(shape).amplitude, 1e-12);
}

TEST(Thermometer, ExactWithoutNoise) {
  Source source;
  const ThermometerSettings settings;
  const Baseline baseline = measure_baseline(source.cold(16), settings);
  PulseThermometer thermometer(baseline, source.curve, settings);
  for (const double rise : {0.0, 1.0, 10.0, 25.0, 40.0}) {
    for (const double energy : {1.0e-6, 2.6e-6, 10e-6}) {
      thermometer.add(source.at(rise, energy));
      const ThermometerSample sample = thermometer.finish();
      EXPECT_EQ(sample.flags, kPulseGood);
      // Rounding to whole codes: 0.3 codes rms over some 60 samples of 1100 codes at least.
      EXPECT_NEAR(sample.volume_temperature, rise, 0.01) << energy;
    }
  }
}

struct Statistics {
  double bias = 0.0;
  double sigma = 0.0;
};

// Over `samples` control samples of m pulses at one temperature.
Statistics measure(PulseThermometer& thermometer, Source& source, double rise, double energy, int m,
                   int samples) {
  double sum = 0.0;
  double squares = 0.0;
  for (int k = 0; k < samples; ++k) {
    for (int i = 0; i < m; ++i) thermometer.add(source.at(rise, energy));
    const double error = thermometer.finish().volume_temperature - rise;
    sum += error;
    squares += error * error;
  }
  const double mean = sum / samples;
  return {mean, std::sqrt(squares / samples - mean * mean)};
}

TEST(Thermometer, BiasBelowATenthOfAKelvinFromZeroToFortyKelvin) {
  // 0.91 K per pulse at 2.6 uJ, 1.5 samples of jitter: the eye's defaults.
  Source source;
  source.jitter = 1.5;
  const double relative = 0.91 * source.curve.slope(22.0) / source.curve.value(22.0);
  source.noise = relative * 3000.0 * source.transducer.gain();
  const ThermometerSettings settings;
  const Baseline baseline = measure_baseline(source.cold(2000), settings);
  EXPECT_NEAR(baseline.scatter, relative, 0.1 * relative);
  PulseThermometer thermometer(baseline, source.curve, settings);
  for (const double rise : {0.0, 5.0, 10.0, 20.0, 30.0, 40.0}) {
    const Statistics found = measure(thermometer, source, rise, 2.6e-6, 10, 1000);
    // The mean of 1000 samples is known to 0.01 K.
    EXPECT_LT(std::abs(found.bias), 0.1) << rise;
    const double predicted =
        predicted_noise(baseline, source.curve, settings, source.noise, 2.6e-6, 22.0 + rise, 10);
    EXPECT_NEAR(predicted, 0.288, 0.01) << "a linear curve: the same at every temperature";
    // 2 % from 1000 samples; the demand is 10 %.
    EXPECT_NEAR(found.sigma, predicted, 0.1 * predicted) << rise;
  }
}

TEST(Thermometer, NoiseFollowsEnergyAndAveraging) {
  Source source;
  source.jitter = 1.0;
  source.noise = 60.0;
  const ThermometerSettings settings;
  const Baseline baseline = measure_baseline(source.cold(1000), settings);
  PulseThermometer thermometer(baseline, source.curve, settings);
  for (const double energy : {1.5e-6, 2.6e-6, 10e-6}) {
    for (const int m : {1, 4, 10}) {
      const Statistics found = measure(thermometer, source, 20.0, energy, m, 1500);
      const double predicted =
          predicted_noise(baseline, source.curve, settings, source.noise, energy, 42.0, m);
      EXPECT_NEAR(found.sigma, predicted, 0.1 * predicted) << energy << " J, " << m;
    }
  }
}

TEST(Thermometer, FlagsWhatMakesAPulseUseless) {
  Source source;
  source.noise = 50.0;
  const ThermometerSettings settings{.energy_max = 20e-6};
  const Baseline baseline = measure_baseline(source.cold(64), settings);
  PulseThermometer thermometer(baseline, source.curve, settings);
  const auto flags_of = [&](const PulseReading& pulse) {
    const std::uint32_t flags = thermometer.add(pulse).flags;
    const ThermometerSample sample = thermometer.finish();
    EXPECT_EQ(sample.flags & flags, flags);
    EXPECT_EQ(std::isnan(sample.volume_temperature), flags != kPulseGood);
    EXPECT_EQ(sample.saturated, (flags & kPulseSaturated) != 0 ? 1 : 0);
    return flags;
  };
  const PulseReading good = source.at(10.0);
  EXPECT_EQ(flags_of(good), kPulseGood);

  PulseReading bad = good;
  bad.transient.codes[50] = kConverterRail;
  EXPECT_EQ(flags_of(bad), kPulseSaturated);
  bad.transient.codes[50] = -32768;
  EXPECT_EQ(flags_of(bad), kPulseSaturated);

  for (const double energy : {0.0, 1e-9, 25e-6, -1e-6, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()}) {
    bad = good;
    bad.energy = energy;
    EXPECT_EQ(flags_of(bad), kPulseEnergyOutOfRange) << energy;
  }

  bad = good;
  source.transducer.write(0.0, 0.0, source.noise, 5, 5, bad.transient);
  EXPECT_EQ(flags_of(bad), kPulseNoArrival) << "noise alone";
  bad.transient = {};
  EXPECT_EQ(flags_of(bad), kPulseNoArrival) << "a dead line";
  source.transducer.write(5000.0, 30.0, 0.0, 5, 5, bad.transient);
  EXPECT_EQ(flags_of(bad), kPulseNoArrival) << "far too late";
}

TEST(Thermometer, ASampleNeedsHalfOfItsPulsesAndAValidTemperature) {
  Source source;
  const ThermometerSettings settings;
  PulseThermometer thermometer(measure_baseline(source.cold(16), settings), source.curve, settings);
  PulseReading dead = source.at(10.0);
  dead.transient = {};
  for (int i = 0; i < 5; ++i) thermometer.add(source.at(10.0));
  for (int i = 0; i < 5; ++i) thermometer.add(dead);
  EXPECT_NEAR(thermometer.finish().volume_temperature, 10.0, 0.01);
  for (int i = 0; i < 4; ++i) thermometer.add(source.at(10.0));
  for (int i = 0; i < 5; ++i) thermometer.add(dead);
  ThermometerSample sample = thermometer.finish();
  EXPECT_NE(sample.flags & kSampleTooFewPulses, 0u);
  EXPECT_TRUE(std::isnan(sample.volume_temperature));
  thermometer.add(source.at(79.0));  // 101 deg C, the curve ends at 100
  sample = thermometer.finish();
  EXPECT_NE(sample.flags & kSampleOutsideCurve, 0u);
  EXPECT_TRUE(std::isnan(sample.volume_temperature));
  EXPECT_TRUE(std::isnan(thermometer.finish().volume_temperature)) << "no pulse, no sample";
}

TEST(Thermometer, BadBaselinesAreRefused) {
  Source source;
  const ThermometerSettings settings;
  EXPECT_THROW(measure_baseline({}, settings), Error);
  EXPECT_THROW(measure_baseline(source.cold(7), settings), Error);
  std::vector<PulseReading> half_dead = source.cold(20);
  for (std::size_t i = 0; i < 11; ++i) half_dead[i].transient = {};
  EXPECT_THROW(measure_baseline(half_dead, settings), Error);
  EXPECT_THROW(PulseThermometer({}, source.curve, settings), Error);
  const Baseline good = measure_baseline(source.cold(8), settings);
  EXPECT_THROW(PulseThermometer(good, source.curve, {.ambient_celsius = 0.5}), Error);
}

TEST(Thermometer, NothingIsAllocatedPerPulse) {
  Source source;
  source.noise = 50.0;
  const ThermometerSettings settings;
  PulseThermometer thermometer(measure_baseline(source.cold(16), settings), source.curve, settings);
  const PulseReading pulse = source.at(10.0);
  const HeapGuard guard;
  thermometer.add(pulse);
  const ThermometerSample sample = thermometer.finish();
  const HeapUse use = guard.use();
  EXPECT_EQ(use, HeapUse{});
  EXPECT_EQ(sample.pulses, 1);
}

TEST(Curve, InvertsWhatItGives) {
  const CurveData quadratic{.source = "test",
                            .coefficients = {0.02, 0.004, 2e-5},
                            .temperatures = {},
                            .values = {},
                            .valid_from_celsius = 10.0,
                            .valid_to_celsius = 90.0};
  const CurveData table{.source = "test",
                        .coefficients = {},
                        .temperatures = {10.0, 30.0, 50.0, 90.0},
                        .values = {0.05, 0.13, 0.22, 0.42},
                        .valid_from_celsius = 10.0,
                        .valid_to_celsius = 90.0};
  for (const CurveData& data : {water_like_curve(), quadratic, table}) {
    const GrueneisenCurve curve(data);
    for (double celsius = 10.0; celsius <= 90.0; celsius += 7.0) {
      EXPECT_NEAR(curve.temperature(curve.value(celsius)), celsius, 1e-9);
      const double step = 1e-3;  // not across a point of the table
      EXPECT_NEAR((curve.value(celsius + step) - curve.value(celsius)) / step,
                  curve.slope(celsius + 0.5 * step), 1e-9);
    }
    EXPECT_TRUE(std::isnan(curve.temperature(curve.value(curve.low()) * 0.999)));
    EXPECT_TRUE(std::isnan(curve.temperature(curve.value(curve.high()) * 1.001)));
    EXPECT_TRUE(std::isnan(curve.temperature(std::numeric_limits<double>::quiet_NaN())));
  }
  EXPECT_TRUE(GrueneisenCurve(water_like_curve()).linear());
  EXPECT_FALSE(GrueneisenCurve(quadratic).linear());
}

TEST(Curve, BadDataIsRefusedByName) {
  const auto message = [](auto change) {
    CurveData data = water_like_curve();
    change(data);
    return message_of([&] { GrueneisenCurve(data, "curve.toml"); });
  };
  EXPECT_NE(message([](CurveData& d) {
              d.coefficients = {0.5, -0.001};
            }).find("rises"),
            std::string::npos);
  EXPECT_NE(message([](CurveData& d) {
              d.coefficients = {-0.1, 0.001};
            }).find("above 0"),
            std::string::npos);
  EXPECT_NE(message([](CurveData& d) {
              d.coefficients = {0.1, 0.02, -2e-4};
            }).find("rises"),
            std::string::npos)
      << "has its top at 50 deg C";
  EXPECT_NE(message([](CurveData& d) { d.valid_to_celsius = 0.0; }).find("curve.valid_C"),
            std::string::npos);
  EXPECT_NE(message([](CurveData& d) {
              d.temperatures = {0.0, 1.0};
            }).find("curve.toml"),
            std::string::npos);
  EXPECT_NE(message([](CurveData& d) {
              d.coefficients.clear();
              d.temperatures = {0.0, 50.0};
              d.values = {1.0, 2.0};
            }).find("inside the table"),
            std::string::npos);
  EXPECT_NE(message([](CurveData& d) {
              d.coefficients[0] = std::numeric_limits<double>::infinity();
            }).find("finite"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
