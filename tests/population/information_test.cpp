// What limits a treatment of eyes that differ.
#include <gtest/gtest.h>

#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/mor/uncertain_fit.hpp"
#include "photocoag/population/information.hpp"

namespace photocoag::testing {
namespace {

Config eye() {
  return load_config(PHOTOCOAG_SOURCE_DIR "/configs/uncertain-eye.toml",
                     {"grid.min_cells=4000", "run.duration_ms=40"});
}

ReducedModel model_of(const Config& config) {
  const auto uncertain = std::make_shared<const UncertainModel>(fit_uncertain_model(
      config.tissue, config.grid, config.estimator.prior, config.control.period));
  ReducedModel model = uncertain->control_model();
  model.uncertain = uncertain;
  return model;
}

TEST(Information, TheStatedDeviationIsTheErrorsAndKnowledgeMakesItSmaller) {
  const Config config = eye();
  const Information all = information_of(config, model_of(config), 60);
  ASSERT_EQ(all.cases.size(), 8u);
  const InformationCase& declared = all.cases.front();
  for (const std::size_t k : {0u, 4u, 39u}) {
    // 60 eyes: the root mean square is known to 1 / sqrt(120) = 9 %.
    EXPECT_NEAR(declared.peak_error[k], declared.peak_sigma[k], 0.3 * declared.peak_sigma[k]) << k;
  }
  EXPECT_LT(declared.peak_sigma.back(), declared.peak_sigma.front());
  for (std::size_t i = 1; i < all.cases.size(); ++i) {
    EXPECT_FALSE(all.cases[i].known.empty());
    // Not quite the same eyes: the known quantity is at its mean in all of them.
    EXPECT_LT(all.cases[i].peak_sigma.back(), 1.02 * declared.peak_sigma.back())
        << all.cases[i].known;
  }
  // Transmission acts on sample and peak alike: no sample tells it from the calibration.
  EXPECT_EQ(all.cases[5].known, "transmission");
  EXPECT_LT(all.cases[5].peak_sigma.back(), 0.9 * declared.peak_sigma.back());
  EXPECT_GT(all.cases[5].held, declared.held);
}

TEST(Information, NeedsAPrior) {
  const Config config = eye();
  EXPECT_THROW(information_of(load_config("", {}), model_of(config), 1), Error);
}

}  // namespace
}  // namespace photocoag::testing
