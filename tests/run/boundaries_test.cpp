// Moving a boundary of zero temperature rise out can only heat; how much is known for the paper's
// tissue.
#include "photocoag/run/boundaries.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace photocoag {
namespace {

const GridSettings kCoarse{.min_cells = 20000};

TEST(Boundaries, FrontOfThePapersTissueIsTooCloseForLongTreatments) {
  Tissue tissue;
  const auto effects = boundary_effects(tissue, kCoarse, 0.7363, {0.1, 0.4, 1000.0});
  ASSERT_EQ(effects.size(), 3U);
  // From the exact step responses: 1164.35 (2 mm more in front and behind) against 1117.43 K/W at
  // 0.4 s, +4.2 %, and 971.77 against 968.03 at 0.1 s, +0.39 %; nearly all of it comes from the
  // front.
  EXPECT_EQ(effects[0].boundary, "front");
  EXPECT_NEAR(effects[0].change[0], 0.0039, 0.001);
  EXPECT_NEAR(effects[0].change[1], 0.042, 0.004);
  EXPECT_GT(effects[0].change[2], 0.1);
  for (const BoundaryEffect& effect : effects) {
    // Grids differ a little between the domains: 1e-4 is their discretization error at this size.
    for (const double change : effect.change) EXPECT_GT(change, -2e-4) << effect.boundary;
  }
  EXPECT_LT(effects[1].change[1], 0.002);
  EXPECT_LT(effects[2].change[1], 0.002);
}

TEST(Boundaries, ALargeDomainDoesNotCareForASecond) {
  Tissue tissue;
  tissue.layers.insert(tissue.layers.begin(), Layer{"vitreous", 4e-3, 0.0});
  tissue.layers.back().thickness = 4e-3;
  tissue.domain_radius = 4e-3;
  for (const BoundaryEffect& effect : boundary_effects(tissue, kCoarse, 1.1, {0.1, 1.0})) {
    for (const double change : effect.change) EXPECT_LT(std::abs(change), 1e-3) << effect.boundary;
  }
}

}  // namespace
}  // namespace photocoag
