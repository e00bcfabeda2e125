// The supervisor beside a controller that has a prior: eyes that it stopped while its witness knew
// alpha alone, all of them healthy, with little pigment in RPE and choroid.
#include <gtest/gtest.h>

#include "photocoag/campaign/campaign_file.hpp"
#include "photocoag/campaign/spot.hpp"
#include "photocoag/run/supervision.hpp"

namespace photocoag {
namespace {

Campaign supervised() {
  return load_campaign(PHOTOCOAG_SOURCE_DIR
                       "/studies/campaigns/uncertain-1khz-supervised.toml");
}

TEST(UncertainEyes, TheWitnessTakesTheChoroidAsUnknownIfThePriorHasIt) {
  const WitnessModel witness = witness_model(supervised().config);
  EXPECT_EQ(witness.choroids, kWitnessChoroids);
  EXPECT_NEAR(witness.choroid.front(), 1000.0 / 2662.2, 1e-3);
  EXPECT_NEAR(witness.choroid.back(), 8000.0 / 2662.2, 1e-2);
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
