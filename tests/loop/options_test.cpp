// Reference profiles, delay, plans of several steps, and eyes that are silent in the dark.
#include <gtest/gtest.h>

#include <cmath>

#include "loop/treatments.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/loop/simulated_eye.hpp"

namespace photocoag::testing {
namespace {

Config config_of(const std::vector<std::string>& overrides) { return load_config("", overrides); }

TEST(ReferenceProfile, IsLinearBetweenItsTimesAndConstantBeyond) {
  const ControlSettings settings{.reference_times = {0.01, 0.03}, .reference_values = {10.0, 20.0}};
  EXPECT_NO_THROW(settings.validate());
  EXPECT_EQ(settings.reference_at(0.0), 10.0);
  EXPECT_NEAR(settings.reference_at(0.025), 17.5, 1e-12);
  EXPECT_EQ(settings.reference_at(1.0), 20.0);
  EXPECT_EQ(ControlSettings{}.reference_at(1.0), 30.0);
  EXPECT_THROW(ControlSettings({.reference_times = {0.01}}).validate(), Error);
  EXPECT_THROW(
      ControlSettings({.reference_times = {0.02, 0.01}, .reference_values = {1.0, 2.0}}).validate(),
      Error);
  EXPECT_THROW(ControlSettings({.reference_times = {0.02}, .reference_values = {40.0}}).validate(),
               Error);
}

TEST(ReferenceProfile, IsFollowed) {
  const Config config = config_of({"control.reference_times_ms=[0, 100, 200]",
                                   "control.reference_K=[10, 20, 20]", "plant.noise_K=0"});
  const Treatment treatment = treat(config);
  for (const CycleRecord& record : treatment.records) {
    if (record.time < 0.02) continue;
    // Model error, 0.83 % of the peak, and the start of the ramp's corner.
    EXPECT_NEAR(record.truth.peak, config.control.reference_at(record.time), 0.3) << record.time;
  }
}

TEST(Delay, ThePowerActsOnePeriodLaterAndTheControllerKnows) {
  const Config config = config_of({"control.delay_cycles=1"});
  const Treatment treatment = treat(config);
  EXPECT_EQ(treatment.records[0].power, 0.0);
  for (std::size_t k = 1; k < treatment.records.size(); ++k) {
    EXPECT_EQ(treatment.records[k].power, treatment.records[k - 1].authorization.power);
  }
  const Outcome delayed = outcome(config, treatment.records);
  EXPECT_EQ(delayed.violations, 0);
  EXPECT_LT(delayed.peak_max, 31.0);
  EXPECT_LT(delayed.rms, 0.2);
  // Without the model of the delay the first powers come twice.
  const ReducedModel& model = default_models(1e-3).reduced();
  ControlSettings ignorant = config.control;
  ignorant.delay = 0;
  Controller controller(model, ignorant, config.estimator);
  SimulatedEye<ReducedPlant> eye(ReducedPlant(model, 1.5), 0.0, 1, {.delay = 1});
  Decision decision = controller.decide();
  double highest = 0.0;
  for (int k = 0; k < 100; ++k) {
    eye.write(decision.power);
    const Reading reading = eye.advance(static_cast<std::uint64_t>(k));
    highest = std::max(highest, reading.truth.peak);
    decision = controller.step(reading.sample);
  }
  EXPECT_GT(highest, 32.0);
}

TEST(SolveEvery, ThePlanIsAppliedInBetween) {
  const Config config =
      config_of({"control.period_ms=0.1", "control.horizon=12", "control.solve_every=10",
                 "run.duration_ms=60", "grid.min_cells=20000"});
  ModelStore models(config, true);
  const Treatment treatment = treat(config, models);
  int solved = 0;
  for (std::size_t k = 0; k < treatment.records.size(); ++k) {
    if (k % 10 != 0) {
      EXPECT_EQ(treatment.records[k].decision.iterations, 0) << k;
    }
    solved += treatment.records[k].decision.iterations > 0 ? 1 : 0;
    if (treatment.records[k].time > 0.03) {
      EXPECT_NEAR(treatment.records[k].truth.peak, 30.0, 1.0);
    }
  }
  EXPECT_GT(solved, 0);
  EXPECT_THROW(ControlSettings({.horizon = 5, .solve_every = 5}).validate(), Error);
  EXPECT_THROW(ControlSettings({.solve_every = 2, .solver = SolverKind::kOsqp}).validate(), Error);
}

TEST(SilentInTheDark, NoPowerNoSample) {
  // The reference falls faster than the tissue cools: a while without power.
  std::vector<std::string> falling{"control.reference_times_ms=[50, 51]",
                                   "control.reference_K=[30, 5]", "run.duration_ms=80",
                                   "plant.zero_power_sample=missing"};
  int dark = 0;
  for (const CycleRecord& record : treat(config_of(falling)).records) {
    EXPECT_EQ(std::isnan(record.measured), record.power == 0.0);
    dark += record.power == 0.0 ? 1 : 0;
  }
  EXPECT_GT(dark, 3);
  // A floor keeps the eye measurable.
  falling.push_back("control.power_min_W=0.001");
  for (const CycleRecord& record : treat(config_of(falling)).records) {
    EXPECT_FALSE(std::isnan(record.measured));
  }
}

}  // namespace
}  // namespace photocoag::testing
