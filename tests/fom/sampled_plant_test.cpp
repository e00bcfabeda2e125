// The sampled eye against the modal one, which it must equal but for rounding.
#include "photocoag/fom/sampled_plant.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "support/heap_guard.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

TEST(SampledPlant, IsTheModalOne) {
  const auto model =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 20000});
  for (const auto how :
       {Discretization::kZeroOrderHold, Discretization::kImplicitEuler, Discretization::kTrBdf2}) {
    for (const double period : {0.1e-3, 1e-3, 4e-3}) {
      const AbsorptionFactors absorption{0.83};
      FullOrderPlant modal(model, how, period, absorption, 0.0);
      SampledPlant sampled(*model, how, period, absorption, 250);
      double worst = 0.0;
      for (std::uint64_t k = 0; k < 250; ++k) {
        const double power = 0.1 * uniform(5, k, RandomStream::kTest);
        modal.step(power);
        sampled.step(power);
        worst = std::max({worst, std::abs(modal.outputs().peak - sampled.outputs().peak),
                          std::abs(modal.outputs().volume - sampled.outputs().volume)});
      }
      // Some 50 K; modes are left out at 1e-15 of themselves, sums have other orders.
      EXPECT_LT(worst, 1e-12) << period << ", discretization " << static_cast<int>(how);
      EXPECT_GT(modal.outputs().peak, 1.0);
    }
  }
}

// As long a treatment as campaigns give it (campaign/spot.cpp), at powers that hold some 30 K.
TEST(SampledPlant, IsTheModalOneToTheEndOfTenThousandCycles) {
  const auto model =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 4000});
  constexpr std::size_t kCycles = 10'000;
  FullOrderPlant modal(model, Discretization::kZeroOrderHold, 1e-3, {0.8}, 0.0);
  SampledPlant sampled(*model, Discretization::kZeroOrderHold, 1e-3, {0.8}, kCycles);
  double worst = 0.0;
  for (std::size_t k = 0; k < kCycles; ++k) {
    const double power = k < 20 ? 0.1 : 0.028 + 0.002 * uniform(6, k, RandomStream::kTest);
    modal.step(power);
    sampled.step(power);
    worst = std::max({worst, std::abs(modal.outputs().peak - sampled.outputs().peak),
                      std::abs(modal.outputs().volume - sampled.outputs().volume)});
  }
  EXPECT_GT(modal.outputs().peak, 20.0);
  EXPECT_LT(modal.outputs().peak, 60.0);
  EXPECT_LT(worst, 1e-12);  // K
}

TEST(SampledPlant, WithoutPowerNothingIsWarm) {
  const FullOrderModel model(Tissue{}, GridSettings{.min_cells = 3000});
  SampledPlant plant(model, Discretization::kZeroOrderHold, 1e-3, {0.8}, 100);
  for (int k = 0; k < 100; ++k) {
    plant.step(0.0);
    EXPECT_EQ(plant.outputs().peak, 0.0);
    EXPECT_EQ(plant.outputs().volume, 0.0);
  }
}

TEST(SampledPlant, StepsAllocateNothingAndEndWithNaN) {
  const FullOrderModel model(Tissue{}, GridSettings{.min_cells = 3000});
  SampledPlant plant(model, Discretization::kZeroOrderHold, 1e-3, {0.8}, 3);
  EXPECT_EQ(plant.outputs().peak, 0.0);
  testing::HeapUse use;
  {
    const testing::HeapGuard guard;
    for (int k = 0; k < 3; ++k) plant.step(0.03);
    use = guard.use();
  }
  EXPECT_EQ(use, testing::HeapUse{});
  EXPECT_GT(plant.outputs().volume, 0.0);
  plant.step(0.03);
  EXPECT_TRUE(std::isnan(plant.outputs().peak));
  EXPECT_TRUE(std::isnan(plant.outputs().volume));
}

}  // namespace
}  // namespace photocoag
