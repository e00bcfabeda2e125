// The full-order model at (alpha, beta).
#include <gtest/gtest.h>

#include <memory>

#include "photocoag/fom/stepper.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

constexpr Discretization kHold = Discretization::kZeroOrderHold;

std::shared_ptr<const FullOrderModel> full_of(const Tissue& tissue) {
  return std::make_shared<const FullOrderModel>(tissue, GridSettings{.min_cells = 3000});
}

Outputs after(FullOrderPlant plant, int periods) {
  for (int k = 0; k < periods; ++k) plant.step(1.0);
  return plant.outputs();
}

// beta is nothing but a factor of the choroid's absorption, on both paths.
TEST(FullOrderAtBeta, IsTheTissueWithThatAbsorption) {
  for (const Tissue& tissue : {Tissue{}, testing::layered(), testing::normalized(Tissue{})}) {
    for (const double beta : {0.5, 1.0, 2.0}) {
      Tissue scaled = tissue;
      scaled.layers[3].absorption *= beta;
      const Outputs expected = after({full_of(scaled), kHold, 1e-3, 0.9}, 50);
      const Outputs found =
          after({full_of(testing::with_beta(tissue)), kHold, 1e-3, {0.9, beta}}, 50);
      // Sums of the same optical depths in another order.
      EXPECT_NEAR(found.peak, expected.peak, 1e-11 * expected.peak) << beta;
      EXPECT_NEAR(found.volume, expected.volume, 1e-11 * expected.volume) << beta;
    }
  }
}

// Where no layer is scaled by it, beta plays no part.
TEST(FullOrderAtBeta, PlaysNoPartWithoutALayer) {
  const auto full = full_of(Tissue{});
  EXPECT_EQ(after({full, kHold, 1e-3, 0.9}, 10).peak,
            after({full, kHold, 1e-3, {0.9, 3.0}}, 10).peak);
}

// The heat equation is linear in the source. To first order in the optical depth the choroid's
// source is proportional to beta: halving a thin choroid's absorption halves its share.
TEST(FullOrderAtBeta, AThinlyAbsorbingChoroidHeatsInProportion) {
  Tissue tissue = testing::with_beta();
  tissue.layers[3].absorption = 1.0;  // 1/m: an optical depth of 4e-4
  const auto full = full_of(tissue);
  const auto peak = [&](double beta) { return after({full, kHold, 1e-3, {0.9, beta}}, 50).peak; };
  const double without = peak(0.0);
  const double one = peak(1.0) - without;
  EXPECT_GT(one, 0.0);
  // The next order is 4e-4 of the share; the differences lose six digits to cancellation.
  EXPECT_NEAR((peak(2.0) - without) / one, 2.0, 2e-3);
  EXPECT_NEAR((peak(0.5) - without) / one, 0.5, 1e-3);
}

}  // namespace
}  // namespace photocoag
