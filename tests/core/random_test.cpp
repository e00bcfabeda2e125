// Counter-based random numbers. All seeds are fixed, so no test here can fail by chance; the bounds
// are those a good generator misses once in a thousand seeds or less.
#include "photocoag/core/random.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

namespace photocoag {
namespace {

constexpr std::size_t kCount = 50000;
constexpr std::uint64_t kMax = std::numeric_limits<std::uint64_t>::max();

std::vector<double> draw(const std::function<double(std::uint64_t)>& sample) {
  std::vector<double> values(kCount);
  for (std::size_t i = 0; i < kCount; ++i) values[i] = sample(i);
  return values;
}

std::vector<double> normals(std::uint64_t seed, RandomStream stream) {
  return draw([=](std::uint64_t cycle) { return standard_normal(seed, cycle, stream); });
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += a[i] * b[i];
    aa += a[i] * a[i];
    bb += b[i] * b[i];
  }
  return ab / std::sqrt(aa * bb);
}

// Largest distance between the empirical and the given distribution, times sqrt(n).
double kolmogorov_smirnov(std::vector<double> values,
                          const std::function<double(double)>& cumulative) {
  std::sort(values.begin(), values.end());
  const double n = static_cast<double>(values.size());
  double distance = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double c = cumulative(values[i]);
    distance = std::max({distance, c - double(i) / n, double(i + 1) / n - c});
  }
  return distance * std::sqrt(n);
}

// Known answer of Philox 4x32-10 from the Random123 library (kat_vectors): counter 0, key 0 gives
// 6627e8d5 e169c58d bc57ac4c 9b00dbd8. A change of generator or of word order changes every
// recorded run.
TEST(Random, IsPhiloxWithTheDocumentedWordOrder) {
  const std::uint64_t bits = 0x6627e8d5e169c58dULL >> 11;
  const double expected = (static_cast<double>(bits) + 0.5) * 0x1.0p-53;
  EXPECT_EQ(uniform(0, 0, static_cast<RandomStream>(0)), expected);
  const std::uint64_t second_bits = 0xbc57ac4c9b00dbd8ULL >> 11;
  const double second = (static_cast<double>(second_bits) + 0.5) * 0x1.0p-53;
  EXPECT_DOUBLE_EQ(
      standard_normal(0, 0, static_cast<RandomStream>(0)),
      std::sqrt(-2.0 * std::log(expected)) * std::cos(2.0 * std::numbers::pi * second));
}

TEST(Random, ValueDoesNotDependOnWhatWasDrawnBefore) {
  const double first = standard_normal(7, 1000, RandomStream::kTest);
  std::vector<double> forward;
  for (std::uint64_t i = 0; i < 100; ++i)
    forward.push_back(standard_normal(7, i, RandomStream::kTest));
  for (std::uint64_t i = 100; i-- > 0;) {
    uniform(8, i, RandomStream::kMeasurementNoise);
    EXPECT_EQ(standard_normal(7, i, RandomStream::kTest), forward[i]);
  }
  EXPECT_EQ(standard_normal(7, 1000, RandomStream::kTest), first);
}

// Every bit of seed, cycle and stream counts, the upper halves too.
TEST(Random, EveryBitOfTheKeyChangesTheValue) {
  const double reference = uniform(0, 0, RandomStream::kTest);
  for (int bit = 0; bit < 64; ++bit) {
    EXPECT_NE(uniform(std::uint64_t{1} << bit, 0, RandomStream::kTest), reference) << bit;
    EXPECT_NE(uniform(0, std::uint64_t{1} << bit, RandomStream::kTest), reference) << bit;
    EXPECT_NE(uniform(std::uint64_t{1} << bit, 0, RandomStream::kTest),
              uniform(0, std::uint64_t{1} << bit, RandomStream::kTest))
        << bit;
  }
  EXPECT_NE(uniform(0, 0, RandomStream::kMeasurementNoise),
            uniform(0, 0, RandomStream::kOnOffPower));
}

TEST(Random, UniformStaysInsideTheOpenInterval) {
  for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, kMax}) {
    for (std::uint64_t i = 0; i < 20000; ++i) {
      const double u = uniform(seed, kMax - i, RandomStream::kTest);
      ASSERT_GT(u, 0.0);
      ASSERT_LT(u, 1.0);
      ASSERT_TRUE(std::isfinite(standard_normal(seed, kMax - i, RandomStream::kTest)));
    }
  }
}

TEST(Random, NormalMoments) {
  const std::vector<double> x = normals(1, RandomStream::kMeasurementNoise);
  double moment[5] = {};
  for (const double value : x) {
    for (int k = 1; k <= 4; ++k) moment[k] += std::pow(value, k) / kCount;
  }
  // Four standard errors: the variances of x, x^2, x^3, x^4 are 1, 2, 15, 96.
  const double unit = 4.0 / std::sqrt(double(kCount));
  EXPECT_NEAR(moment[1], 0.0, unit);
  EXPECT_NEAR(moment[2], 1.0, unit * std::sqrt(2.0));
  EXPECT_NEAR(moment[3], 0.0, unit * std::sqrt(15.0));
  EXPECT_NEAR(moment[4], 3.0, unit * std::sqrt(96.0));
}

// 1.95: exceeded by the true distribution with probability 1e-3.
TEST(Random, PassesKolmogorovSmirnov) {
  for (std::uint64_t seed : {std::uint64_t{1}, std::uint64_t{2}, std::uint64_t{123456789012}}) {
    EXPECT_LT(
        kolmogorov_smirnov(normals(seed, RandomStream::kMeasurementNoise),
                           [](double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }),
        1.95);
    EXPECT_LT(kolmogorov_smirnov(draw([=](std::uint64_t i) {
                                   return uniform(seed, i, RandomStream::kOnOffPower);
                                 }),
                                 [](double x) { return x; }),
              1.95);
  }
}

// A test of a test: the same bound catches a normal that is 3 % too wide.
TEST(Random, KolmogorovSmirnovCanFail) {
  EXPECT_GT(kolmogorov_smirnov(
                normals(1, RandomStream::kMeasurementNoise),
                [](double x) { return 0.5 * std::erfc(-x / (1.03 * std::numbers::sqrt2)); }),
            1.95);
}

TEST(Random, SeedsStreamsAndCyclesAreUncorrelated) {
  // Four standard errors of a correlation.
  const double bound = 4.0 / std::sqrt(double(kCount));
  const std::vector<double> x = normals(1, RandomStream::kMeasurementNoise);
  EXPECT_LT(std::abs(correlation(x, normals(2, RandomStream::kMeasurementNoise))), bound);
  EXPECT_LT(
      std::abs(correlation(x, normals(std::uint64_t{1} << 32, RandomStream::kMeasurementNoise))),
      bound);
  EXPECT_LT(std::abs(correlation(x, normals(1, RandomStream::kOnOffPower))), bound);
  EXPECT_LT(std::abs(correlation(x, normals(1, RandomStream::kTest))), bound);
  for (const std::uint64_t lag : {1, 2, 16}) {
    EXPECT_LT(std::abs(correlation(x, draw([=](std::uint64_t i) {
                                     return standard_normal(1, i + lag,
                                                            RandomStream::kMeasurementNoise);
                                   }))),
              bound)
        << lag;
  }
}

}  // namespace
}  // namespace photocoag
