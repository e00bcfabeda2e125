// A session's file: what it plans, and what it is refused for.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "photocoag/core/files.hpp"
#include "photocoag/session/learning.hpp"
#include "photocoag/session/session_file.hpp"
#include "session/sessions.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

class SessionFile : public ::testing::Test {
 protected:
  Session load(const std::string& text) {
    write_file(folder_.file("session.toml"), text);
    return load_session(folder_.file("session.toml"));
  }
  std::string refusal(const std::string& text) {
    return message_of([&] { load(text); });
  }
  TemporaryFolder folder_;
};

TEST_F(SessionFile, SpotsHaveTheirOwnReferenceGoalAndEye) {
  const Session session = load(small_session());
  ASSERT_EQ(session.spots.size(), 3U);
  EXPECT_EQ(session.configs[0].control.peak_reference, 30.0);
  EXPECT_EQ(session.configs[0].run.goal, Goal::kDuration);
  EXPECT_EQ(session.configs[1].control.peak_reference, 20.0);
  EXPECT_EQ(session.configs[1].run.goal, Goal::kHold);
  EXPECT_DOUBLE_EQ(session.configs[1].run.hold, 0.005);
  EXPECT_DOUBLE_EQ(session.spots[1].x, 300e-6);
  EXPECT_DOUBLE_EQ(session.spots[2].y, -200e-6);
  EXPECT_EQ(session.configs[2].plant.absorption_factor, 0.5);
  EXPECT_NE(session.configs[0].run.seed, session.configs[1].run.seed);
  EXPECT_EQ(session.place.kind, DeviceAddress::Kind::kVirtual);
}

TEST_F(SessionFile, AGridIsCentredAndNamedByRowAndColumn) {
  const Session session = load(
      "[grid]\nrows = 2\ncolumns = 3\nspacing_um = 400\ndose = 0.5\n"
      "[[spot]]\nname = \"extra\"\n");
  ASSERT_EQ(session.spots.size(), 7U);
  EXPECT_EQ(session.spots[0].name, "A1");
  EXPECT_EQ(session.spots[5].name, "B3");
  EXPECT_EQ(session.spots[6].name, "extra");
  EXPECT_DOUBLE_EQ(session.spots[0].x, -400e-6);
  EXPECT_DOUBLE_EQ(session.spots[0].y, 200e-6);
  EXPECT_DOUBLE_EQ(session.spots[5].x, 400e-6);
  EXPECT_EQ(session.configs[4].run.goal, Goal::kDose);
  EXPECT_EQ(session.configs[6].run.goal, Goal::kDuration);
}

TEST_F(SessionFile, SharedQuantitiesAreTheSameForAllSpotsAndVariedOnesAreNot) {
  const std::string random =
      "[[shared]]\nkey = \"plant.sample_gain\"\ndistribution = \"uniform\"\nlow = 0.9\nhigh = 1.1\n"
      "[[varied]]\nkey = \"plant.absorption_factor\"\ndistribution = \"uniform\"\nlow = 0.6\n"
      "high = 1.2\n";
  const Session session = load(small_session("", random));
  std::set<double> gains, alphas;
  for (const Config& config : session.configs) {
    gains.insert(config.plant.bench.sample_gain);
    alphas.insert(config.plant.absorption_factor);
  }
  EXPECT_EQ(gains.size(), 1U);
  EXPECT_EQ(alphas.size(), 3U);
  EXPECT_NE(*gains.begin(), 1.0);
  const std::vector<Config> others = session_configs(session, session.seed + 1);
  EXPECT_NE(others[0].plant.bench.sample_gain, *gains.begin());
  EXPECT_EQ(session_configs(session, session.seed)[0], session.configs[0]);
}

TEST_F(SessionFile, BadFilesAreRefusedByKeyAndValue) {
  const auto says = [&](const std::string& text, const std::string& part) {
    const std::string message = refusal(text);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  const std::string spot = "[[spot]]\nname = \"A\"\n";
  says("", "spot: found 0 spots");
  says("title = \"x\"\n" + spot, "title: unknown key");
  says("[session]\ncolour = 1\n" + spot, "session.colour: unknown key");
  says(spot + "power = 1\n", "spot.power: unknown key");
  says("[[spot]]\nx_um = 1\n", "spot.name: the key is missing");
  says("[[spot]]\nname = \"../A\"\n", "spot.name: found \"../A\"");
  says(spot + spot, "a name that no other spot has");
  says(spot + "hold_ms = 5\ndose = 1\n", "no dose beside hold_ms");
  says(spot + "reference_K = 40\n", "spot A");
  says(spot + "reference_K = \"warm\"\n", "spot.reference_K: found \"warm\"");
  says("[session]\npause_ms = -1\n" + spot, "session.pause_ms: found -1");
  says("[session]\ndevice = \"eye\"\npacing = \"virtual\"\n" + spot, "\"clock\" on a device");
  says("[limits]\nenergy_mJ = 0\n" + spot, "limits.energy_mJ: found 0");
  says("[grid]\nrows = 2\ncolumns = 2\n", "grid.spacing_um: the key is missing");
  says("[session]\nlearn = true\nset = [\"control.robust=certified\"]\n" + spot, "session.learn");
  says(spot +
           "[[varied]]\nkey = \"control.horizon\"\ndistribution = \"uniform\"\nlow = 2\n"
           "high = 5\n",
       "varied.key: found control.horizon");
}

TEST_F(SessionFile, TheWorstEnergyIsFullPowerForAllOfTheDurationOrTheSupervisorsLimit) {
  Session session = load(small_session());
  // 20 cycles of 1 ms, and one more that an overrun may hold, at 0.1 W.
  EXPECT_DOUBLE_EQ(worst_energy(session.configs[0]), 21 * 1e-3 * 0.1);
  session.configs[0].safety.energy_max = 1e-3;
  EXPECT_DOUBLE_EQ(worst_energy(session.configs[0]), 1e-3);
}

AttemptOutcome treated(double alpha, SpotEnding ending = SpotEnding::kTreated) {
  AttemptOutcome outcome;
  outcome.ending = ending;
  outcome.absorption = alpha;
  return outcome;
}

TEST(Learning, TheConfiguredPriorCountsAsOneSpotAndTheDeviationIsThatOfTheNextSpot) {
  EstimatorSettings configured;
  configured.absorption_initial = 0.7;
  configured.absorption_sigma_initial = 0.2;
  EXPECT_EQ(learnt(configured, {}, 0.05), configured);
  const EstimatorSettings one = learnt(configured, {treated(0.9)}, 0.05);
  EXPECT_DOUBLE_EQ(one.absorption_initial, 0.8);
  // Between the two 0.1, of the prior's variance a half; one and a half times all that.
  EXPECT_NEAR(one.absorption_sigma_initial, std::sqrt(1.5 * (0.01 + 0.04 / 2.0)), 1e-12);
  const EstimatorSettings many = learnt(configured, std::vector(10'000, treated(0.9)), 0.05);
  EXPECT_NEAR(many.absorption_initial, 0.9, 1e-4);
  EXPECT_EQ(many.absorption_sigma_initial, 0.05) << "not below the floor";
}

TEST(Learning, OnlySpotsThatWentToTheirEndTeach) {
  EstimatorSettings configured;
  for (const SpotEnding ending :
       {SpotEnding::kStopped, SpotEnding::kInterrupted, SpotEnding::kMayHaveEmitted,
        SpotEnding::kDeviceFault, SpotEnding::kSkipped}) {
    EXPECT_EQ(learnt(configured, {treated(1.9, ending)}, 0.05), configured);
  }
  EXPECT_FALSE(learnt(configured, {treated(1.9, SpotEnding::kGoalMissed)}, 0.05) == configured);
  const EstimatorSettings bound = learnt(configured, std::vector(100, treated(9.0)), 0.05);
  EXPECT_EQ(bound.absorption_initial, configured.absorption_max);
}

}  // namespace
}  // namespace photocoag::testing
