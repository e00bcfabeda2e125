// The adversary against the margin of declared tissue: eyes at corners of the set that a margin
// searched along single directions let above the limit.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "photocoag/config/config.hpp"
#include "photocoag/population/spots.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag {
namespace {

using Settings = std::vector<std::string>;

Config declared(const Settings& more) {
  Settings set{"control.robust=certified", "control.horizon=2",
               "uncertainty.spot_radius_relative=0.1", "uncertainty.thickness_relative=0.1",
               "uncertainty.absorption_relative=0.1"};
  set.insert(set.end(), more.begin(), more.end());
  return load_config("", set);
}

struct Outcome {
  std::size_t over = 0;
  double peak_max = 0.0;
  double held = 0.0;
};

// `count` treatments of each eye; the margin is searched once.
std::vector<Outcome> attacked(const Settings& controller, const std::vector<Settings>& eyes,
                              std::size_t count, const SpotRange& range = {}) {
  const Config config = declared(controller);
  ModelStore models(config, false);
  const Config controlled = controller_config(config, models.reduced());
  std::vector<Outcome> outcomes;
  for (const Settings& eye : eyes) {
    Config one = controlled;
    one.plant = load_config("", eye).plant;
    one.uncertainty = {};
    const auto corner =
        treat_corners(one, models.reduced(), range, config.control.peak_max, {.count = count});
    outcomes.push_back({corner[0].over, corner[0].peak_max, corner[0].held_mean});
  }
  return outcomes;
}

const Settings kWideRpe{"plant.tissue.spot_radius_um=90",
                        "plant.tissue.layers.RPE.thickness_um=6.6",
                        "plant.tissue.layers.choroid.absorption_per_m=2928.42"};
const Settings kAllLess{"plant.tissue.spot_radius_um=90",
                        "plant.tissue.layers.RPE.thickness_um=5.4",
                        "plant.tissue.layers.choroid.absorption_per_m=2395.98"};
const Settings kThinGap{"plant.tissue.spot_radius_um=90",
                        "plant.tissue.layers.RPE.thickness_um=6.6",
                        "plant.tissue.layers.unpigmented.thickness_um=3.6"};

// The search along single directions let 23 %, 0.9 % and some 1 % of these above 32 K, by up to
// 3.4 K: of 1,500 treatments some 345, 13 and 15. Two are accepted.
TEST(DeclaredCorners, StayBelowTheLimitAt250Hertz) {
  const Settings controller{"control.period_ms=4", "run.duration_ms=100"};
  for (const Outcome& eye : attacked(controller, {kWideRpe, kAllLess, kThinGap}, 1500)) {
    EXPECT_LE(eye.over, 2U) << eye.peak_max;
    EXPECT_GT(eye.held, 26.5);  // K: what is given up for it
  }
}

}  // namespace
}  // namespace photocoag
