// Every duration is counted once, and quantiles do not lie below or above what was counted.
#include "photocoag/core/duration_histogram.hpp"

#include <gtest/gtest.h>

#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

TEST(DurationHistogram, EveryEntryIsSomewhere) {
  DurationHistogram histogram(1e-3);
  EXPECT_EQ(histogram.bins().size(), 2000u);
  for (const std::int64_t ns : {-5L, 0L, 999L, 1000L, 1'999'999L, 2'000'000L, 1L << 60}) {
    histogram.add(ns);
  }
  histogram.skip();
  EXPECT_EQ(histogram.cycles(), 8u);
  EXPECT_EQ(histogram.counted(), 7u);
  EXPECT_EQ(histogram.negative(), 1u);
  EXPECT_EQ(histogram.bins()[0], 2u);
  EXPECT_EQ(histogram.bins()[1999], 1u);
  EXPECT_EQ(histogram.overflow(), 2u);
  EXPECT_EQ(histogram.quantile_us(0.4), 1.0);
  EXPECT_EQ(DurationHistogram().quantile_us(0.5), 0.0);
}

TEST(DurationHistogram, QuantilesAreUpperEdgesAndAtMostTheLargest) {
  auto histogram = DurationHistogram::with_bins(10);
  for (const std::int64_t ns : {1'100, 1'200, 2'300, 7'400}) histogram.add(ns);
  EXPECT_EQ(histogram.quantile_us(0.5), 2.0);
  EXPECT_EQ(histogram.quantile_us(0.75), 3.0);
  EXPECT_EQ(histogram.quantile_us(1.0), 7.4);
  histogram.add(123'456);  // above the bins: exact
  EXPECT_EQ(histogram.quantile_us(1.0), 123.456);
  EXPECT_EQ(histogram.min_us(), 1.1);
  EXPECT_EQ(histogram.max_us(), 123.456);
}

TEST(DurationHistogram, CountingTakesNothingFromTheHeap) {
  auto histogram = DurationHistogram::with_bins(1000);
  HeapUse use;
  {
    const HeapGuard guard;
    for (std::int64_t ns = -10; ns < 2'000'000; ns += 997) histogram.add(ns);
    histogram.skip();
    use = guard.use();
  }
  EXPECT_EQ(use, HeapUse{});
}

}  // namespace
}  // namespace photocoag::testing
