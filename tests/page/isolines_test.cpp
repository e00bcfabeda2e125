// Lines of equal value: they lie where the field says, and bound what is inside.
#include "photocoag/page/isolines.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace photocoag {
namespace {

template <class Value>
GridField field_of(int count, Value value) {
  GridField field;
  for (int k = 0; k < count; ++k) {
    field.x.push_back(0.1 * k * k);  // not equidistant
    field.y.push_back(1.5 * k);
  }
  for (const double y : field.y)
    for (const double x : field.x) field.values.push_back(value(x, y));
  return field;
}

// Twice the area inside, positive if the inside is on the left.
double doubled_area(const std::vector<Isoline>& lines) {
  double sum = 0.0;
  for (const Isoline& line : lines)
    for (std::size_t k = 0; k < line.x.size(); ++k) {
      const std::size_t next = (k + 1) % line.x.size();
      sum += line.x[k] * line.y[next] - line.x[next] * line.y[k];
    }
  return sum;
}

TEST(Isolines, OfAPlaneAreExact) {
  const GridField plane = field_of(21, [](double x, double y) { return 2.0 * x - y; });
  const std::vector<Isoline> lines = isolines(plane, 25.0);
  ASSERT_EQ(lines.size(), 1U);
  std::size_t inside = 0;
  for (std::size_t k = 0; k < lines[0].x.size(); ++k) {
    const double x = lines[0].x[k], y = lines[0].y[k];
    const bool border = y == 0.0 || x == 40.0 || y == 30.0;
    EXPECT_TRUE(border || std::abs(2.0 * x - y - 25.0) < 1e-12) << x << " " << y;
    inside += border ? 0 : 1;
  }
  EXPECT_GT(inside, 10U);
  // 2 x - y >= 25 on [0, 40] x [0, 30]: a trapezoid of 27.5 and 12.5 by 30.
  EXPECT_NEAR(doubled_area(lines), 2.0 * 0.5 * (27.5 + 12.5) * 30.0, 1e-9);
}

TEST(Isolines, AHoleIsALineTheOtherWayRound) {
  const GridField ring = field_of(40, [](double x, double y) {
    return -std::abs(std::hypot((x - 76.0) / 76.0, (y - 29.0) / 29.0) - 0.6);
  });
  const std::vector<Isoline> lines = isolines(ring, -0.2);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_LT(doubled_area({lines[0]}) * doubled_area({lines[1]}), 0.0);
  const double expected = std::acos(-1.0) * 76.0 * 29.0 * (0.64 - 0.16);
  EXPECT_NEAR(0.5 * doubled_area(lines), expected, 0.02 * expected);
}

// Every line is a loop of its own and every crossing belongs to one; saddles join nothing.
TEST(Isolines, ASaddleIsApartOrJoinedByItsMean) {
  GridField checks{.x = {0, 1, 2, 3}, .y = {0, 1, 2, 3}, .values = std::vector<double>(16, 0.0)};
  checks.values[5] = checks.values[10] = 1.0;  // neighbours over a corner
  EXPECT_EQ(isolines(checks, 0.6).size(), 2U);
  EXPECT_EQ(isolines(checks, 0.4).size(), 1U);
  EXPECT_TRUE(isolines(checks, 1.5).empty());
  EXPECT_EQ(isolines(checks, -1.0).size(), 1U) << "all of it: the border";
  EXPECT_NEAR(doubled_area(isolines(checks, -1.0)), 18.0, 1e-12);
}

TEST(Isolines, LevelsAreRoundAndBelowTheHighest) {
  EXPECT_EQ(isoline_levels(40.0, 8.0), (std::vector<double>{5, 10, 15, 20, 25, 30, 35}));
  EXPECT_TRUE(isoline_levels(0.0, 8.0).empty());
  EXPECT_TRUE(isoline_levels(NAN, 8.0).empty());
}

}  // namespace
}  // namespace photocoag
