// Full-order eyes of a prior: the estimate is as good as it says, and as a batch estimate that
// shares no sums with it; the supervisor beside such a controller stops no healthy eye.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <utility>

#include "photocoag/campaign/campaign_file.hpp"
#include "photocoag/campaign/posterior_consistency.hpp"
#include "photocoag/campaign/spot.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {
namespace {

Campaign supervised() {
  return load_campaign(PHOTOCOAG_SOURCE_DIR "/studies/campaigns/uncertain-1khz-supervised.toml");
}

TEST(UncertainEyes, TheObserverTakesTheChoroidAsUnknownIfThePriorHasIt) {
  const ObserverModel observer = observer_model(supervised().config);
  EXPECT_EQ(observer.choroids, kObserverChoroids);
  EXPECT_NEAR(observer.choroid.front(), 1000.0 / 2662.2, 1e-3);
  EXPECT_NEAR(observer.choroid.back(), 8000.0 / 2662.2, 1e-2);
}

Campaign unsupervised() {
  return load_campaign(PHOTOCOAG_SOURCE_DIR "/studies/campaigns/uncertain-1khz.toml");
}

TEST(UncertainEyes, TheEstimateIsAsGoodAsABatchEstimateAndAsItSays) {
  const Campaign campaign = unsupervised();
  const PosteriorConsistency all =
      posterior_consistency(campaign, make_spot_models(campaign, true), 90);
  ASSERT_EQ(all.cycles.size(), 250U);
  EXPECT_LT(all.rms_K, 1.05 * all.batch_rms_K);
  EXPECT_GT(all.rms_K, 0.95 * all.batch_rms_K);
  // 90 eyes: the standard deviation of such a mean is 0.15 to 0.3, that of a share 0.023 to 0.04.
  for (const std::size_t k : {4U, 9U, 49U, 249U}) {
    EXPECT_NEAR(all.cycles[k].nees[0], 1.0, 0.45) << k;
    EXPECT_NEAR(all.cycles[k].covered[0], 0.95, 0.06) << k;
    for (std::size_t third = 1; third <= 3; ++third) {
      EXPECT_NEAR(all.cycles[k].nees[third], 1.0, 0.75) << k;
    }
  }
  EXPECT_TRUE(std::isnan(all.cycles[0].batch_rms_K));
  // The bound falls with the probability, and is kept.
  ASSERT_EQ(all.bounds.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_LT(all.bounds[i].held_K, all.bounds[i - 1].held_K);
  EXPECT_LE(all.bounds[2].over_limit, 2U);
}

TEST(UncertainEyes, APriorThatIsTooNarrowIsSeenByItsErrors) {
  Campaign campaign = unsupervised();
  // The eyes stay; the controller believes deviations of a third.
  for (double& entry : campaign.config.estimator.prior.covariance) entry /= 9.0;
  const PosteriorConsistency all =
      posterior_consistency(campaign, make_spot_models(campaign, true), 45);
  EXPECT_GT(all.cycles[249].nees[0], 2.0);
  EXPECT_LT(all.cycles[249].covered[0], 0.85);
}

// The highest true peak over three absorption factors, and how many treatments were stopped.
std::pair<double, int> with_samples_a_fifth_too_low(const std::string& config) {
  double peak = 0.0;
  int stopped = 0;
  for (const char* const alpha : {"0.5", "0.7363", "1.1"}) {
    const Config eye = load_config(PHOTOCOAG_SOURCE_DIR "/configs/" + config,
                                   {"safety.supervisor=on", "plant.sample_gain=0.8",
                                    std::string("plant.absorption_factor=") + alpha});
    ModelStore models(eye, true);
    const std::atomic<bool> stop{false};
    std::atomic<std::size_t> progress{0};
    const Treatment treatment = run_treatment(eye, models, virtual_eye(), stop, progress);
    for (const CycleRecord& cycle : treatment.records) peak = std::max(peak, cycle.truth.peak);
    stopped += treatment.outcome.stopped ? 1 : 0;
  }
  return {peak, stopped};
}

TEST(UncertainEyes, SamplesThatShowAFifthTooLittleAreNotNoticed) {
  const auto [uncertain, unnoticed] = with_samples_a_fifth_too_low("uncertain-eye.toml");
  EXPECT_NEAR(uncertain, 33.1, 0.2);
  EXPECT_EQ(unnoticed, 0);
  const auto [nominal, stopped] = with_samples_a_fifth_too_low("paper-1khz.toml");
  EXPECT_NEAR(nominal, 35.7, 0.2);
  EXPECT_EQ(stopped, 3);
}

TEST(UncertainEyes, HealthyOnesOfLittlePigmentAreNotStopped) {
  const Campaign campaign = supervised();
  const SpotModels models = make_spot_models(campaign, true);
  SpotRunner runner(campaign, models);
  for (const std::uint64_t spot : {51U, 74U, 84U, 103U, 4634U, 31387U}) {
    const SpotRecord record = runner.run(spot);
    EXPECT_EQ(record.outcomes[outcome_index("stopped")], 0.0) << spot;
    EXPECT_LT(record.outcomes[outcome_index("peak_max_K")], 33.0) << spot;
  }
}

}  // namespace
}  // namespace photocoag
