// The last function before the laser.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "photocoag/core/random.hpp"
#include "photocoag/core/types.hpp"
#include "photocoag/loop/gate.hpp"

namespace photocoag {
namespace {

constexpr double kMax = 0.1;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// A pure function: it can be evaluated by the compiler.
static_assert(gate(0.05, kMax).power == 0.05);
static_assert(gate(0.2, kMax).power == 0.0);

TEST(Gate, PassesWhatIsAllowed) {
  for (const double power : {0.0, 1e-300, 0.004, 0.05, std::nextafter(kMax, 0.0), kMax}) {
    EXPECT_EQ(gate(power, kMax).power, power);
    EXPECT_EQ(gate(power, kMax).verdict, GateVerdict::kPassed);
  }
}

TEST(Gate, RefusesWhatIsNotANumber) {
  for (const double power :
       {kNaN, -kNaN, kInfinity, -kInfinity, std::numeric_limits<double>::signaling_NaN()}) {
    EXPECT_EQ(gate(power, kMax).power, 0.0);
    EXPECT_EQ(gate(power, kMax).verdict, GateVerdict::kNotFinite);
  }
}

TEST(Gate, RefusesWhatIsOutside) {
  // 2143289344 is a solver's "not a number" that is finite (OSQP); 30 is a power in mW.
  for (const double power : {-1e-300, -1e-12, -0.05, -kInfinity / 2, 0.1 * (1 + 1e-11), 0.2, 30.0,
                             2143289344.0, 1.7e308, -1.7e308}) {
    if (!std::isfinite(power)) continue;
    EXPECT_EQ(gate(power, kMax).power, 0.0) << power;
    EXPECT_EQ(gate(power, kMax).verdict, GateVerdict::kOutside) << power;
  }
}

TEST(Gate, NegativeZeroAndDenormalsAreHarmless) {
  EXPECT_EQ(gate(-0.0, kMax).power, 0.0);
  EXPECT_EQ(gate(-0.0, kMax).verdict, GateVerdict::kPassed);
  const double least = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(gate(least, kMax).power, least);
  EXPECT_EQ(gate(-least, kMax).power, 0.0);
  EXPECT_EQ(gate(-least, kMax).verdict, GateVerdict::kOutside);
}

TEST(Gate, RoundingAboveTheLimitBecomesTheLimit) {
  for (const double factor : {1 + 1e-15, 1 + 1e-13, 1 + 9e-13}) {
    EXPECT_EQ(gate(kMax * factor, kMax).power, kMax);
    EXPECT_EQ(gate(kMax * factor, kMax).verdict, GateVerdict::kPassed);
  }
}

TEST(Gate, NoBitPatternGetsThrough) {
  for (std::uint64_t k = 0; k < 200000; ++k) {
    const auto high = static_cast<std::uint64_t>(uniform(1, k, RandomStream::kTest) * 0x1p32);
    const auto low = static_cast<std::uint64_t>(uniform(2, k, RandomStream::kTest) * 0x1p32);
    const double power = std::bit_cast<double>(high << 32 | low);
    const GateResult result = gate(power, kMax);
    ASSERT_TRUE(result.power >= 0.0 && result.power <= kMax) << power;
    ASSERT_TRUE(result.power == 0.0 || std::abs(result.power - power) <= 1e-12 * kMax) << power;
  }
}

}  // namespace
}  // namespace photocoag
