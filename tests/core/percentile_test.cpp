#include "photocoag/core/percentile.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace photocoag {
namespace {

TEST(Percentile, IsTheNearestRank) {
  EXPECT_EQ(percentile(std::vector{7.0}, 0.99), 7.0);
  const std::vector<double> values = {5, 1, 4, 2, 3};
  EXPECT_EQ(percentile(values, 0.0), 1.0);
  EXPECT_EQ(percentile(values, 0.5), 3.0);
  EXPECT_EQ(percentile(values, 1.0), 5.0);
  EXPECT_EQ(percentile(values, 0.6), 3.0);
  EXPECT_EQ(percentile(values, 0.63), 4.0);
  EXPECT_EQ(percentile(std::vector<std::int64_t>{3, 1, 2}, 0.5), 2);
}

}  // namespace
}  // namespace photocoag
