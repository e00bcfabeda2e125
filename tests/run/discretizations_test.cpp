// What the schemes miss: implicit Euler is too low and slow to converge, TR-BDF2 far less.
#include "photocoag/run/discretizations.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/tissues.hpp"

namespace photocoag {
namespace {

TEST(Discretizations, ImplicitEulerIsTwelvePercentLowAfterTheFirstStep) {
  const auto full = std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{});
  const auto all = discretization_errors(full, 0.7363, {1e-3, 4e-3}, 100);
  ASSERT_EQ(all.size(), 4U);
  // From the gamma average of the exact step response: -12 % at 1 ms, -13 % at 4 ms, -2 % at step
  // 10.
  EXPECT_NEAR(all[0].peak(1), -0.12, 0.005);
  EXPECT_NEAR(all[2].peak(1), -0.13, 0.005);
  EXPECT_NEAR(all[0].peak(10), -0.02, 0.005);
  for (const std::size_t euler : {0U, 2U}) {
    for (std::size_t steps = 1; steps <= 100; ++steps) {
      EXPECT_LT(all[euler].peak(steps), 0.0) << "always on the unsafe side";
      if (steps > 3) {
        EXPECT_LT(std::abs(all[euler + 1].peak(steps)), 0.2 * std::abs(all[euler].peak(steps)));
      }
    }
  }
}

TEST(Discretizations, WorksOnLayeredTissue) {
  const auto full =
      std::make_shared<const FullOrderModel>(testing::layered(), GridSettings{.min_cells = 5000});
  const auto all = discretization_errors(full, 1.1, {1e-3}, 5);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_NEAR(all[0].peak(1), -0.12, 0.02);
}

}  // namespace
}  // namespace photocoag
