#include "photocoag/config/suggest.hpp"

#include <gtest/gtest.h>

namespace photocoag {
namespace {

const std::vector<std::string> kKeys = {"control", "control.period_ms", "control.power_max_W",
                                        "plant.noise_K", "run.seed"};

TEST(NearestKey, FindsSlipsUnitsAndWrongSections) {
  EXPECT_EQ(nearest_key("control.perod_ms", kKeys), "control.period_ms");
  EXPECT_EQ(nearest_key("control.period_us", kKeys), "control.period_ms");
  EXPECT_EQ(nearest_key("control.power_max_mW", kKeys), "control.power_max_W");
  EXPECT_EQ(nearest_key("control.noise_K", kKeys), "plant.noise_K");
  EXPECT_EQ(nearest_key("seed", kKeys), "run.seed");
  EXPECT_EQ(nearest_key("Contol", kKeys), "control");
}

TEST(NearestKey, IsSilentWhenNothingIsNear) {
  EXPECT_EQ(nearest_key("control.xyzzy_quux", kKeys), "");
  EXPECT_EQ(nearest_key(std::string(100000, 'a'), kKeys), "");
  EXPECT_EQ(nearest_key("", {}), "");
}

}  // namespace
}  // namespace photocoag
