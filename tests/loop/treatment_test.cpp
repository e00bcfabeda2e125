// The paper's scenarios in closed loop on the full-order eye (more than 80,000 cells): what must
// hold for every seed, and how each choice of cost behaves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "loop/treatments.hpp"

namespace photocoag::testing {
namespace {

constexpr int kSeeds = 20;

/// What a case must do for every seed. The numbers are those that were seen over the 20 seeds,
/// widened by about half of their spread or a cycle: they say how a choice of cost behaves, not how
/// well a seed did.
struct Case {
  std::string name;
  std::string file;
  std::vector<std::string> overrides;
  double alpha;
  double time_to_95_min_ms;
  double time_to_95_max_ms;
  double peak_max;  ///< K, true
  double rms_max = 0.4;
  double rms_min = 0.0;
  int limit_active_run_min = 0;
};

void expect(const Case& c) {
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(c.name + ", alpha " + std::to_string(c.alpha) + ", seed " + std::to_string(seed));
    std::vector<std::string> overrides = c.overrides;
    overrides.push_back("plant.absorption_factor=" + std::to_string(c.alpha));
    overrides.push_back("run.seed=" + std::to_string(seed));
    const Config config = shipped(c.file, overrides);
    const Treatment treatment = treat(config);
    ASSERT_EQ(treatment.records.size(), config.cycles());
    ASSERT_GE(treatment.full_order_states, 80000u);
    const Outcome o = outcome(config, treatment.records);
    EXPECT_EQ(o.unsolved, 0);
    EXPECT_LE(o.peak_max, c.peak_max);
    EXPECT_GE(o.time_to_95 * 1e3, c.time_to_95_min_ms - 1e-6);
    EXPECT_LE(o.time_to_95 * 1e3, c.time_to_95_max_ms + 1e-6);
    EXPECT_LE(o.rms, c.rms_max);
    EXPECT_GE(o.rms, c.rms_min);
    // sigma of alpha at the end is some 0.5 %.
    EXPECT_LE(std::abs(o.alpha_error), 0.04);
    EXPECT_GE(o.limit_active_run, c.limit_active_run_min);
    if (c.peak_max <= config.control.peak_max) {
      EXPECT_EQ(o.violations, 0);
    }
  }
}

TEST(Treatment, ThePaperAt1kHz) {
  // Peak and RMS: what the release promises. Time: 0.1 W for some cycles, then deadbeat; 17.5 K per
  // cycle at most.
  for (const char* horizon : {"control.horizon=2", "control.horizon=10"}) {
    expect({"1 kHz", "paper-1khz.toml", {horizon}, 0.5, 6, 8, 31.3});
    expect({"1 kHz", "paper-1khz.toml", {horizon}, 1.1, 3, 4, 31.3});
  }
}

TEST(Treatment, WithoutPenaltiesTheHorizonPlaysNoPart) {
  // Far from the limit R1 = R2 = 0 is a clipped deadbeat controller whatever N.
  for (const double alpha : {0.5, 1.1}) {
    const std::string eye = "plant.absorption_factor=" + std::to_string(alpha);
    const Treatment two = treat(shipped("paper-1khz.toml", {eye}));
    const Treatment ten = treat(shipped("paper-1khz.toml", {eye, "control.horizon=10"}));
    ASSERT_EQ(two.records.size(), ten.records.size());
    for (std::size_t k = 0; k < two.records.size(); ++k) {
      // The plan is determined through products of gains: condition some 1e5, rounding some 1e-11
      // of 0.1 W; with the loop's memory of a few cycles.
      ASSERT_NEAR(two.records[k].power, ten.records[k].power, 1e-8) << k;
    }
  }
}

TEST(Treatment, PenaltiesAndDelayedWeightAt1kHz) {
  const std::string n5 = "control.horizon=5";
  // R1 pulls toward the steady power, which is too little on the way up: slow, and an error that
  // lasts.
  const std::string r1 = "control.power_weight=5e4";
  expect({"R1", "paper-1khz.toml", {n5, r1}, 0.5, 35, 60, 30.3, 0.8, 0.4});
  expect({"R1", "paper-1khz.toml", {n5, r1}, 1.1, 10, 19, 30.3, 0.4, 0.15});
  // R2 carries the high power of the start on for a while: overshoot, no error that lasts.
  const std::string r2 = "control.power_change_weight=5e4";
  expect({"R2", "paper-1khz.toml", {n5, r2}, 0.5, 6, 9, 31.0});
  expect({"R2", "paper-1khz.toml", {n5, r2}, 1.1, 3, 5, 31.2});
  // Delayed R0: the first three outputs are not scored, the first powers are near the steady one.
  const std::string delayed = "control.state_weight=delayed";
  for (const char* weight : {"control.power_weight=5e1", "control.power_change_weight=5e1"}) {
    expect({"delayed", "paper-1khz.toml", {n5, delayed, weight}, 0.5, 6, 8, 31.0});
    expect({"delayed", "paper-1khz.toml", {n5, delayed, weight}, 1.1, 4, 5, 31.0});
  }
}

TEST(Treatment, HoldsAnActiveLimit) {
  // A hundred times the paper's R2 lets the power change so slowly that only the limit stops it:
  // the plan runs along 32 K for 9 cycles or more (alpha 0.5), 5 (alpha 1.1).
  const std::vector<std::string> slow = {"control.horizon=10", "control.power_change_weight=1e6"};
  expect({"slow", "paper-1khz.toml", slow, 0.5, 10, 14, 31.6, 0.4, 0.0, 6});
  expect({"slow", "paper-1khz.toml", slow, 1.1, 7, 9, 31.6, 0.4, 0.0, 4});
  // A limit 0.05 K above the reference: held for 9 cycles and more. The estimate keeps it; the
  // truth exceeds it by what the estimate does not know (sigma of the peak some 0.1 to 0.2 K). No
  // supervisor: its gate keeps the limit for every plausible alpha and holds 0.7 K less.
  const std::vector<std::string> tight = {"control.horizon=10", "control.power_change_weight=5e4",
                                          "control.peak_max_K=30.05", "safety.supervisor=off"};
  expect({"tight", "paper-1khz.toml", tight, 0.5, 6, 9, 30.05 + 0.4, 0.4, 0.0, 10});
  expect({"tight", "paper-1khz.toml", tight, 1.1, 3, 5, 30.05 + 0.5, 0.4, 0.0, 6});
}

TEST(Treatment, TheLimitIsKeptByThePlanThatHoldsIt) {
  const Config config =
      shipped("paper-1khz.toml",
              {"control.horizon=10", "plant.noise_K=0.0", "control.power_change_weight=1e6",
               "plant.model=reduced", "plant.absorption_factor=0.7363"});
  const Treatment treatment = treat(config);
  const Outcome o = outcome(config, treatment.records);
  EXPECT_GE(o.limit_active_run, 3);
  // Model, alpha and samples are exact: what was planned happens, to the solver's rounding.
  EXPECT_LE(o.peak_max, config.control.peak_max + 1e-9);
  EXPECT_GT(o.peak_max, config.control.peak_reference + 0.2);
}

TEST(Treatment, TheFourCasesAt250Hz) {
  // a: R1 holds the first power near the steady one of alpha 0.7363. Alpha 1.1: 4 ms of it are
  // enough, without any sample; alpha 0.5: slow.
  expect({"a", "paper-250hz-a.toml", {}, 0.5, 20, 48, 30.4, 0.55});
  expect({"a", "paper-250hz-a.toml", {}, 1.1, 4, 4, 30.6, 0.3});
  // b, d: three periods near the steady power while alpha is learned, then as fast as the model
  // says.
  expect({"b", "paper-250hz-b.toml", {}, 0.5, 16, 24, 31.2, 0.3});
  expect({"b", "paper-250hz-b.toml", {}, 1.1, 16, 16, 31.2, 0.3});
  expect({"d", "paper-250hz-d.toml", {}, 0.5, 16, 20, 31.2, 0.3});
  expect({"d", "paper-250hz-d.toml", {}, 1.1, 16, 16, 31.2, 0.3});
  // c: R2 against the steady power of cycle 0: faster than b and d.
  expect({"c", "paper-250hz-c.toml", {}, 0.5, 12, 20, 31.2, 0.3});
  expect({"c", "paper-250hz-c.toml", {}, 1.1, 8, 12, 31.4, 0.3});
}

TEST(Treatment, WithoutPenaltyAt250HzTheFirstPeriodOvershoots) {
  // The paper's reason for penalties: one period of 4 ms at the power that suits alpha 0.7363 heats
  // a spot with alpha 1.1 far above the limit, before there is any sample. Afterwards the loop
  // recovers.
  const Config config =
      shipped("paper-250hz-a.toml", {"control.power_weight=0.0", "plant.absorption_factor=1.1"});
  const Treatment treatment = treat(config);
  const Outcome o = outcome(config, treatment.records);
  EXPECT_GT(treatment.records[0].truth.peak, 36.0);
  EXPECT_EQ(o.peak_max, treatment.records[0].truth.peak);
  EXPECT_EQ(o.violations, 1);
  EXPECT_LE(o.rms, 0.3);
}

TEST(Treatment, TheEyesAlphaIsNotInTheFirstPower) {
  const Treatment weak = treat(shipped("paper-1khz.toml", {"plant.absorption_factor=0.5"}));
  const Treatment strong = treat(shipped("paper-1khz.toml", {"plant.absorption_factor=1.1"}));
  EXPECT_TRUE(same(weak.records[0].decision.power, strong.records[0].decision.power));
  EXPECT_TRUE(
      same(weak.records[0].decision.power_reference, strong.records[0].decision.power_reference));
  EXPECT_FALSE(same(weak.records[0].truth.peak, strong.records[0].truth.peak));
}

TEST(Treatment, RepeatsBitForBitAndSeedsDiffer) {
  const Treatment one = treat(shipped("paper-1khz.toml", {"run.seed=3"}));
  const Treatment two = treat(shipped("paper-1khz.toml", {"run.seed=3"}));
  const Treatment other = treat(shipped("paper-1khz.toml", {"run.seed=4"}));
  EXPECT_TRUE(same(one.records, two.records));
  EXPECT_FALSE(same(one.records, other.records));
}

TEST(Treatment, ADifferentTissueOfTheEyeIsInTheTruthOnly) {
  const std::string coarse = "grid.min_cells=10000";
  const Config plain = shipped("paper-1khz.toml", {coarse});
  const Config small_spot = shipped("paper-1khz.toml", {coarse, "plant.tissue.spot_radius_um=90"});
  ModelStore plain_models(plain, true);
  ModelStore small_models(small_spot, true);
  const Treatment expected = treat(plain, plain_models);
  const Treatment found = treat(small_spot, small_models);
  // What the controller believes, and hence its first power, is the same to the last bit.
  EXPECT_TRUE(plain_models.reduced().A_d == small_models.reduced().A_d);
  EXPECT_TRUE(plain_models.reduced().B_d == small_models.reduced().B_d);
  EXPECT_TRUE(plain_models.reduced().C_volume == small_models.reduced().C_volume);
  EXPECT_TRUE(same(expected.records[0].power, found.records[0].power));
  // The same power on 81 % of the area: 1 / 0.81 hotter at first, as long as heat leaves through
  // depth alone.
  const double ratio = found.records[0].truth.peak / expected.records[0].truth.peak;
  EXPECT_NEAR(ratio, 1.0 / 0.81, 0.02);
  // The estimator blames alpha for it; the loop stays stable.
  EXPECT_GT(found.records.back().estimate.absorption_factor,
            expected.records.back().estimate.absorption_factor + 0.05);
  EXPECT_LE(outcome(small_spot, found.records).peak_max, 34.0);
}

// What is shipped for other tissues, and layers that conduct differently: aim reached, limit kept.
TEST(Treatment, OtherTissues) {
  const std::string coarse = "grid.min_cells=20000";
  const std::vector<std::string> layers = {coarse,
                                           "tissue.layers.sclera.conductivity_W_per_mK=0.4",
                                           "tissue.layers.choroid.heat_capacity_J_per_kgK=3600",
                                           "tissue.layers.choroid.perfusion_W_per_m3K=1e6",
                                           "tissue.beam=gaussian",
                                           "tissue.spot_radius_um=141"};  // as bright on the axis
  for (const Config& config :
       {shipped("in-vivo.toml", {coarse}), shipped("literature-choroid.toml", {coarse}),
        shipped("paper-vitreous.toml", {coarse}), shipped("paper-1khz.toml", layers)}) {
    ModelStore models(config, true);
    const Outcome o = outcome(config, treat(config, models).records);
    // The noise of one sample is 0.288 K; the default tissue's overshoot is 0.4 K at most.
    EXPECT_LT(o.peak_max, config.control.peak_reference + 0.8);
    EXPECT_EQ(o.violations, 0);
    EXPECT_EQ(o.unsolved, 0);
    EXPECT_LT(o.time_to_95, 10e-3);
    EXPECT_LT(o.rms, 0.3);
    EXPECT_LT(std::abs(o.alpha_error), 0.05);
  }
}

TEST(Treatment, AReducedEyeBehavesLikeTheFullOne) {
  const Config full = shipped("paper-1khz.toml");
  const Config reduced = shipped("paper-1khz.toml", {"plant.model=reduced"});
  const Treatment one = treat(full);
  const Treatment two = treat(reduced);
  const Outcome a = outcome(full, one.records);
  const Outcome b = outcome(reduced, two.records);
  EXPECT_TRUE(same(one.records[0].power, two.records[0].power));
  // The reduced model's error is below 1 % of 30 K, alpha's about as much.
  EXPECT_NEAR(a.peak_max, b.peak_max, 0.3);
  EXPECT_NEAR(a.rms, b.rms, 0.1);
  EXPECT_NEAR(a.alpha_error, b.alpha_error, 0.01);
  EXPECT_EQ(a.time_to_95, b.time_to_95);
  EXPECT_EQ(two.full_order_states, one.full_order_states);
}

}  // namespace
}  // namespace photocoag::testing
