// Options of a sweep and the order of its combinations.
#include "photocoag/study/sweep.hpp"

#include <gtest/gtest.h>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

TEST(Sweep, CommasInsideBracketsAndQuotesDoNotSeparate) {
  const Varied varied = parse_varied("a.b=1,[2, 3],\"x,y\",{c = 1, d = 2}");
  EXPECT_EQ(varied.key, "a.b");
  EXPECT_EQ(varied.values, (std::vector<std::string>{"1", "[2, 3]", "\"x,y\"", "{c = 1, d = 2}"}));
  for (const char* wrong : {"a", "=1", "a=", "a=1,,2", "a=[1,2"}) {
    EXPECT_THROW(parse_varied(wrong), Error) << wrong;
  }
}

TEST(Sweep, EveryCombinationOnceTheLastKeyFastest) {
  const auto points = sweep(
      "", {"run.duration_ms=5", "plant.model=reduced"},
      {parse_varied("control.horizon=2,5"), parse_varied("plant.absorption_factor=0.5,0.8,1.1")}, 1,
      false);
  ASSERT_EQ(points.size(), 6U);
  EXPECT_EQ(points[1].values, (std::vector<std::string>{"2", "0.8"}));
  EXPECT_EQ(points[5].values, (std::vector<std::string>{"5", "1.1"}));
  EXPECT_EQ(points[5].result.config.control.horizon, 5);
  EXPECT_EQ(points[5].result.trajectories.front().peak_K.size(), 5U);
}

TEST(Sweep, ABadValueIsRefusedBeforeAnythingRuns) {
  EXPECT_THROW(sweep("", {}, {parse_varied("control.horizon=2,99")}, 1, false), Error);
}

}  // namespace
}  // namespace photocoag
