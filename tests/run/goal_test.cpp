// Treatments that end when they have had what they need.
#include <gtest/gtest.h>

#include "loop/treatments.hpp"
#include "photocoag/run/goal.hpp"

namespace photocoag::testing {
namespace {

Treatment with_goal(std::vector<std::string> settings) {
  settings.emplace_back("run.duration_ms=400");
  return treat(shipped("paper-1khz.toml", settings));
}

TEST(Goal, HoldsTheTemperatureForTheTimeAskedFor) {
  const Treatment treatment = with_goal({"run.goal=hold", "run.hold_ms=50"});
  EXPECT_TRUE(treatment.outcome.goal_reached);
  EXPECT_FALSE(treatment.outcome.stopped);
  EXPECT_EQ(treatment.outcome.safety.state, SafetyState::kDone);
  EXPECT_NEAR(treatment.goal.held(), 0.05, 1e-9);
  int held = 0;
  for (const CycleRecord& record : treatment.records) {
    held += record.estimate.outputs.peak >= 0.95 * 30.0 && record.power > 0.0 ? 1 : 0;
  }
  EXPECT_EQ(held, 50) << "cycles of 1 ms";
  EXPECT_EQ(treatment.records.back().power, 0.0);
  EXPECT_LT(treatment.records.size(), 60u) << "3 ms of rise, 50 ms, one period at 0 W";
}

TEST(Goal, EndsAtTheDose) {
  const Treatment treatment = with_goal({"run.goal=dose", "run.dose=0.1"});
  ASSERT_TRUE(treatment.outcome.goal_reached);
  EXPECT_GE(treatment.goal.dose(), 0.1);
  // One period at the reference adds 0.0042: the end comes at most so much too late.
  EXPECT_LT(treatment.goal.dose(), 0.1045);
  EXPECT_EQ(treatment.records.back().power, 0.0);
}

TEST(Goal, NotReachedTheDurationEndsIt) {
  const Treatment treatment = with_goal({"run.goal=dose", "run.dose=1000"});
  EXPECT_FALSE(treatment.outcome.goal_reached);
  EXPECT_EQ(treatment.records.size(), 400u);
  EXPECT_FALSE(treatment.outcome.stopped);
}

TEST(Goal, WithoutOneNothingChanges) {
  EXPECT_FALSE(GoalWatch().reached());
  EXPECT_FALSE(with_goal({}).outcome.goal_reached);
}

}  // namespace
}  // namespace photocoag::testing
