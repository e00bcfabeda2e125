// The adversary: every combination of the declared extremes, and it finds what goes wrong there.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "loop/treatments.hpp"
#include "photocoag/population/spots.hpp"

namespace photocoag::testing {
namespace {

TEST(Corners, AreAllCombinationsAndASmallSpotIsTheHottest) {
  const Config config = load_config(
      "", {"grid.min_cells=2000", "control.period_ms=4", "control.horizon=2", "run.duration_ms=100",
           "control.robust=certified", "uncertainty.spot_radius_relative=0.1",
           "uncertainty.absorption_relative=0.1"});
  ModelStore models(config, true);
  // Not backed off: the limit is exceeded.
  const auto corners = treat_corners(config, models.reduced(), {}, 32.0, {.count = 8});
  std::map<std::string, double> highest;
  for (const CornerOutcome& corner : corners) {
    highest[corner.name] = corner.peak_max;
    EXPECT_EQ(corner.over > 0, corner.peak_max > 32.0) << corner.name;
    EXPECT_GT(corner.held_mean, 20.0) << corner.name;
    EXPECT_LE(corner.held_mean, corner.peak_max) << corner.name;
  }
  ASSERT_EQ(highest.size(), 4U);
  EXPECT_GT(highest.at("--"), 32.0);
  EXPECT_GT(highest.at("--"), highest.at("+-"));
  EXPECT_GT(highest.at("-+"), highest.at("++"));
}

}  // namespace
}  // namespace photocoag::testing
