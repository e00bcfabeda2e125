// The margin of declared tissue in the closed loop.
#include <gtest/gtest.h>

#include "loop/treatments.hpp"
#include "photocoag/population/spots.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag::testing {
namespace {

Config config_of(const std::vector<std::string>& overrides) { return load_config("", overrides); }

TEST(TissueMargin, KeepsTheLimitForAnEyeAsDeclared) {
  const std::vector<std::string> declared{"uncertainty.spot_radius_relative=0.1",
                                          "uncertainty.thickness_relative=0.1",
                                          "uncertainty.absorption_relative=0.1"};
  const Config config = config_of(declared);
  const TissueMargin margin = tissue_margin(config, default_models(1e-3).reduced());
  EXPECT_GT(margin.peak_unprotected, config.control.peak_max);
  EXPECT_LE(margin.peak_protected, config.control.peak_max);
  // What is given up of the temperature that is held in the end.
  ASSERT_FALSE(margin.shares.empty());
  EXPECT_LT(margin.factor * margin.shares.back(), 0.97);
  EXPECT_GT(margin.factor * margin.shares.back(), 0.85);
  EXPECT_NE(margin.worst.find("spot radius -10 %"), std::string::npos) << margin.worst;
  const Config controlled = backed_off(config, margin);
  EXPECT_DOUBLE_EQ(controlled.control.peak_max, 32.0 * margin.factor);
  // An eye inside the declared set, with noise.
  Config eye = config_of({"plant.tissue.spot_radius_um=91", "plant.absorption_factor=0.8"});
  eye.control = controlled.control;
  ModelStore models(eye, false);
  const Treatment treatment = treat(eye, models);
  for (const CycleRecord& record : treatment.records) EXPECT_LE(record.truth.peak, 32.0);
  // Nothing declared, nothing taken away.
  EXPECT_EQ(tissue_margin(config_of({}), default_models(1e-3).reduced()).factor, 1.0);
}

}  // namespace
}  // namespace photocoag::testing
