// The eye of a bench, against the ordinary eye in small steps: what acts and is seen between the
// ends of the periods is exact.
#include "photocoag/fom/intersample_plant.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "photocoag/core/random.hpp"
#include "photocoag/fom/stepper.hpp"
#include "support/heap_guard.hpp"
#include "support/tissues.hpp"

namespace photocoag {
namespace {

constexpr double kPeriod = 1e-3;
constexpr int kParts = 20;  // of a period
constexpr int kPeriods = 6;
constexpr AbsorptionFactors kAlpha{0.8};

std::shared_ptr<const FullOrderModel> small_model() {
  static const auto model =
      std::make_shared<const FullOrderModel>(Tissue{}, GridSettings{.min_cells = 3000});
  return model;
}

double power_of(int period) {
  return period < 0 ? 0.0
                    : 0.1 * uniform(5, static_cast<std::uint64_t>(period), RandomStream::kTest);
}

// Outputs after each twentieth of a period, the power `lag` twentieths late; entry 0: cold.
std::vector<Outputs> fine_run(int lag) {
  FullOrderPlant plant(small_model(), Discretization::kZeroOrderHold, kPeriod / kParts, kAlpha);
  std::vector<Outputs> outputs(1);
  for (int k = 0; k < kPeriods * kParts; ++k) {
    plant.step(power_of((k - lag + kParts) / kParts - 1));
    outputs.push_back(plant.outputs());
  }
  return outputs;
}

TEST(Intersample, InstantsAreThoseOfTheEyeInSmallSteps) {
  struct Case {
    int power_lag;
    int sample_lag;
  };
  for (const auto [power_lag, sample_lag] :
       {Case{0, 0}, Case{7, 0}, Case{0, 9}, Case{7, 9}, Case{13, 20}, Case{20, 0}, Case{20, 20}}) {
    SCOPED_TRACE(::testing::Message() << power_lag << " " << sample_lag);
    const std::vector<Outputs> fine = fine_run(power_lag);
    IntersamplePlant plant(small_model(), kPeriod, kAlpha,
                           {.averaging = 0.0,
                            .sample_lag = sample_lag / double(kParts),
                            .power_lag = power_lag / double(kParts)},
                           0.0);
    for (int n = 0; n < kPeriods; ++n) {
      plant.step(power_of(n));
      const auto end = static_cast<std::size_t>((n + 1) * kParts);
      EXPECT_NEAR(plant.outputs().peak, fine[end].peak, 1e-9 * fine[end].peak + 1e-12);
      EXPECT_NEAR(plant.outputs().volume, fine[end].volume, 1e-9 * fine[end].volume + 1e-12);
      const double seen = fine[end - static_cast<std::size_t>(sample_lag)].volume;
      EXPECT_NEAR(plant.sample(), seen, 1e-9 * seen + 1e-12);
    }
  }
}

// Piece by piece between the changes of power, Simpson's rule in 200 steps.
double mean_volume(double begin, double end, double lag) {
  FullOrderPlant plant(small_model(), Discretization::kZeroOrderHold, 1.0, kAlpha, 0.0);
  std::vector<double> cuts = {0.0};
  for (int n = 0; n <= kPeriods; ++n) {
    for (const double cut : {begin, end, n + lag}) {
      if (cut > 0.0 && cut <= end) cuts.push_back(cut);
    }
  }
  std::sort(cuts.begin(), cuts.end());
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double length = cuts[i + 1] - cuts[i];
    if (length < 1e-12) continue;
    const double power = power_of(static_cast<int>(std::floor(cuts[i] - lag + 1e-9)));
    const bool counts = cuts[i] >= begin - 1e-9;
    const int steps = counts ? 200 : 1;
    plant.set_period(kPeriod * length / steps);
    double values = plant.outputs().volume;
    for (int s = 1; s <= steps; ++s) {
      plant.step(power);
      values += plant.outputs().volume * (s == steps ? 1.0 : s % 2 == 1 ? 4.0 : 2.0);
    }
    if (counts) sum += values * length / steps / 3.0;
  }
  return sum / (end - begin);
}

TEST(Intersample, MeansAreIntegralsOverTheirWindow) {
  for (const IntersampleTiming timing :
       {IntersampleTiming{1.0, 0.0, 0.0}, IntersampleTiming{0.3, 0.0, 0.0},
        IntersampleTiming{1.0, 0.5, 0.0}, IntersampleTiming{1.0, 0.0, 0.35},
        IntersampleTiming{0.6, 1.0, 1.0}}) {
    SCOPED_TRACE(::testing::Message()
                 << timing.averaging << " " << timing.sample_lag << " " << timing.power_lag);
    IntersamplePlant plant(small_model(), kPeriod, kAlpha, timing, 0.0);
    for (int n = 0; n < 3; ++n) plant.step(power_of(n));
    const double end = 3.0 - timing.sample_lag;
    const double mean = mean_volume(end - timing.averaging, end, timing.power_lag);
    // The fastest modes of the grid bend within one of Simpson's steps.
    EXPECT_NEAR(plant.sample(), mean, 1e-4 * mean);
    EXPECT_GT(mean, 0.1);
  }
}

// Heat stays where it was absorbed: two eyes of constant absorption, one heated first, one later.
TEST(Intersample, DriftChangesWhereTheNextHeatGoes) {
  constexpr double kDrift = 200.0;  // far beyond what a configuration takes: 20 % per period
  IntersamplePlant plant(small_model(), kPeriod, kAlpha, {}, kDrift);
  FullOrderPlant early(small_model(), Discretization::kZeroOrderHold, kPeriod, kAlpha);
  FullOrderPlant late(small_model(), Discretization::kZeroOrderHold, kPeriod, 0.96);
  plant.step(0.05);
  early.step(0.05);
  EXPECT_NEAR(plant.sample(), early.outputs().volume, 1e-9 * plant.sample());
  plant.step(0.08);
  EXPECT_DOUBLE_EQ(plant.absorption_factor(), 0.96);
  early.step(0.0);
  late.step(0.08);
  const double peak = early.outputs().peak + late.outputs().peak;
  EXPECT_NEAR(plant.outputs().peak, peak, 1e-9 * peak);
  // The sample weights the early heat by the absorption of now: not the sum of the two volumes.
  EXPECT_GT(plant.sample(), early.outputs().volume + late.outputs().volume);
  for (int n = 0; n < 100; ++n) plant.step(0.0);
  EXPECT_DOUBLE_EQ(plant.absorption_factor(), 5.0) << "kept where a configuration may put it";
}

TEST(Intersample, StepAllocatesNothing) {
  if (!testing::heap_guard_sees_malloc()) GTEST_SKIP() << "Eigen calls malloc itself";
  IntersamplePlant plant(small_model(), kPeriod, kAlpha, {0.5, 0.5, 0.5}, 0.3);
  testing::HeapUse use;
  {
    const testing::HeapGuard guard;
    for (int k = 0; k < 10; ++k) plant.step(0.1);
    use = guard.use();
  }
  EXPECT_EQ(use, testing::HeapUse{});
  EXPECT_GT(plant.sample(), 0.0);
}

}  // namespace
}  // namespace photocoag
