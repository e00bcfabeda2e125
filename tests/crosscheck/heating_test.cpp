// What the cross-check sums and steps side by side has the bits of one after the other.
#include "photocoag/crosscheck/heating.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace photocoag::crosscheck {
namespace {

std::vector<double> waves(std::size_t size, double step) {
  std::vector<double> values(size);
  for (std::size_t k = 0; k < size; ++k) values[k] = std::sin(step * static_cast<double>(k + 1));
  return values;
}

TEST(Heating, GramSumsHaveTheBitsOfAPlainLoop) {
  constexpr std::size_t kNodes = 37;
  for (std::size_t count = 1; count <= 19; ++count) {
    const Sources sources{count, waves(kNodes * count, 0.7)};
    const GramSum sum(sources, kNodes);
    for (const std::size_t stride : {1, 4}) {
      const std::vector<double> heat = waves(kNodes * count * stride, 1.3);
      std::vector<double> gram = waves(count * count, 2.1);
      std::vector<double> expected = gram;
      sum.add(gram.data(), heat.data(), stride, 0.3);
      for (std::size_t i = 0; i < kNodes; ++i) {
        for (std::size_t a = 0; a < count; ++a) {
          const double scaled = 0.3 * heat[(i * count + a) * stride];
          for (std::size_t b = 0; b < count; ++b) {
            expected[a * count + b] += scaled * sources.load[i * count + b];
          }
        }
      }
      EXPECT_EQ(gram, expected) << count << " sources, stride " << stride;
    }
  }
}

Pencil pencil(double loss) {
  constexpr std::size_t kNodes = 9;
  Pencil one;
  one.mass = {std::vector<double>(kNodes, 4.0 + loss), std::vector<double>(kNodes, 1.0)};
  one.stiffness = {std::vector<double>(kNodes, 2.0 + loss), std::vector<double>(kNodes, -1.0)};
  return one;
}

TEST(Heating, ATermSideBySideWithOthersIsThatTermAlone) {
  const Sources sources{3, waves(27, 0.9)};
  std::vector<Pencil> pencils;
  for (const double loss : {0.1, 0.7, 3.0, 20.0}) pencils.push_back(pencil(loss));
  Heating together(pencils, sources);
  together.advance(0.4, 2);
  together.advance(1.7, 3);
  for (std::size_t l = 0; l < kLanes; ++l) {
    Heating alone(std::vector<Pencil>(kLanes, pencils[l]), sources);
    alone.advance(0.4, 2);
    alone.advance(1.7, 3);
    for (std::size_t k = 0; k < sources.load.size(); ++k) {
      EXPECT_EQ(together.lane(l)[k * kLanes], alone.lane(0)[k * kLanes]) << l << " " << k;
    }
  }
}

// Long after it was switched on: stiffness T = load.
TEST(Heating, SettlesWhereTheLoadIsCarriedAway) {
  const Sources sources{2, waves(18, 0.9)};
  Heating heating(std::vector<Pencil>(kLanes, pencil(0.5)), sources);
  heating.advance(400.0, 400);
  Symmetric factors = pencil(0.5).stiffness;
  factors.factorize();
  std::vector<double> settled = sources.load;
  factors.solve(settled, 2);
  for (std::size_t k = 0; k < settled.size(); ++k) {
    EXPECT_NEAR(heating.lane(0)[k * kLanes], settled[k], 1e-12);  // sums of nine terms below 3
  }
}

}  // namespace
}  // namespace photocoag::crosscheck
