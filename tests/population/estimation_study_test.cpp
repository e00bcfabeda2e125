// Consistency of the estimator as issue and documents promise it, over many eyes with fixed seeds.
#include <gtest/gtest.h>

#include "photocoag/population/estimation_study.hpp"

namespace photocoag {
namespace {

constexpr int kSeeds = 60;

Config small_config() {
  Config config;
  config.grid.min_cells = 4000;  // its accuracy plays no part, that eye and model share it does
  return config;
}

EstimationCycle over(const EstimationScenario& scenario, std::size_t begin, std::size_t end,
                     const Config& config = small_config()) {
  ModelStore models(config, true);
  return estimation_statistics(config, models, scenario, kSeeds).mean(begin, end);
}

// Errors of one eye are correlated over tens of cycles: a mean over 60 eyes and 200 cycles has some
// 300 independent squares, standard deviation 0.08. Innovations are not: 15,000, 0.012.

TEST(EstimationStudy, MatchedEyeWithNarrowPriorIsConsistentInEveryDimension) {
  const EstimationCycle mean =
      over({.name = "", .full_order = false, .matched_noise = true, .prior_sigma = 0.002}, 50, 250);
  EXPECT_NEAR(mean.nis, 1.0, 0.04);
  EXPECT_NEAR(mean.nees, 1.0, 0.2);
  EXPECT_NEAR(mean.nees_alpha, 1.0, 0.35);
  EXPECT_NEAR(mean.nees_peak, 1.0, 0.3);
}

TEST(EstimationStudy, AWrongNoiseIsSeen) {
  // What the test above is worth: the same filter, told half the noise.
  Config config = small_config();
  config.estimator.measurement_noise = 0.144;
  const EstimationCycle mean =
      over({.name = "", .full_order = false, .matched_noise = true, .prior_sigma = 0.002}, 50, 250,
           config);
  EXPECT_GT(mean.nis, 2.0);
  EXPECT_GT(mean.nees, 1.5);
}

TEST(EstimationStudy, FullOrderEyeHasConsistentInnovationsAndPeak) {
  const EstimationCycle mean = over({}, 0, 250);
  EXPECT_GT(mean.nis, 0.85);
  EXPECT_LT(mean.nis, 1.1);
  EXPECT_GT(mean.nees_peak, 0.5);
  EXPECT_LT(mean.nees_peak, 1.8);
  // The first samples come with 100 mW, where alpha enters far from linearly: the filter ends up
  // surer than it should be.
  EXPECT_LT(mean.nees_alpha, 2.5);
  EXPECT_LT(over({}, 50, 250).rms_alpha, 0.005);
}

TEST(EstimationStudy, OutliersAndGapsCostLittle) {
  const EstimationCycle clean = over({}, 50, 250);
  const EstimationCycle outliers = over({.name = "", .outliers = 0.02}, 50, 250);
  EXPECT_NEAR(outliers.rejected, 0.02, 0.004);  // binomial: 0.0013
  EXPECT_LT(outliers.rms_peak, 1.3 * clean.rms_peak);
  Config open = small_config();
  open.estimator.outlier_sigma = 0.0;
  EXPECT_GT(over({.name = "", .outliers = 0.02}, 50, 250, open).rms_peak, 2.0 * clean.rms_peak)
      << "the gate has nothing to do: the test tests nothing";
  const EstimationCycle gap = over({.name = "", .gap_begin = 50, .gap_end = 100}, 100, 250);
  EXPECT_LT(gap.rms_peak, 1.5 * clean.rms_peak);
  EXPECT_LT(gap.nees_peak, 2.0);
}

TEST(EstimationStudy, WithoutLightTheEstimateStays) {
  const EstimationCycle mean = over({.name = "", .dark = true}, 0, 250);
  EXPECT_LT(mean.moved_alpha, 0.025);  // a tenth of the prior's deviation
  EXPECT_NEAR(mean.sigma_alpha, 0.25, 0.01);
}

TEST(EstimationStudy, MovingHorizonIsConsistentFromTheFirstSamplesOn) {
  Config config = small_config();
  config.estimator.kind = EstimatorKind::kMhe;
  const EstimationCycle mean = over({}, 0, 250, config);
  EXPECT_GT(mean.nis, 0.85);
  EXPECT_LT(mean.nis, 1.1);
  EXPECT_LT(mean.nees_alpha, 1.7);
  EXPECT_GT(mean.nees_alpha, 0.6);
  // It linearizes again when it knows more: the first 10 ms are where it gains.
  EXPECT_LT(over({}, 0, 10, config).rms_peak, 0.9 * over({}, 0, 10).rms_peak);
}

TEST(EstimationStudy, IsDeterministic) {
  const Config config = small_config();
  ModelStore models(config, true);
  const auto first = estimation_statistics(config, models, {.name = "", .outliers = 0.1}, 3);
  const auto second = estimation_statistics(config, models, {.name = "", .outliers = 0.1}, 3);
  for (std::size_t k = 0; k < first.cycles.size(); ++k) {
    ASSERT_EQ(first.cycles[k].rms_peak, second.cycles[k].rms_peak);
  }
}

}  // namespace
}  // namespace photocoag
