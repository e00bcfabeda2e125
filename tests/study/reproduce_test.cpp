// Verdicts come from the data: the shipped studies are read, judged, and falsified.
#include "photocoag/study/reproduce.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

const fs::path kStudies = fs::path(PHOTOCOAG_SOURCE_DIR) / "studies";

Study study(const std::string& id) { return load_study(kStudies / (id + ".toml")); }

TEST(Reproduce, EveryShippedStudyIsInThePlanAndReads) {
  const Plan plan = load_plan(kStudies / "plan.toml");
  std::set<std::string> planned(plan.studies.begin(), plan.studies.end());
  std::size_t claims = 0;
  for (const auto& entry : fs::directory_iterator(kStudies)) {
    if (entry.path().extension() != ".toml" || entry.path().stem() == "plan") continue;
    EXPECT_EQ(planned.count(entry.path().stem()), 1U) << entry.path();
    const Study read = load_study(entry.path());
    claims += read.claims.size();
    for (const Claim& claim : read.claims) {
      // A verdict that is expected to differ has its reason written beside it.
      if (claim.expected == "differs") {
        EXPECT_FALSE(claim.differs.empty()) << claim.text;
      }
    }
  }
  EXPECT_GE(claims, 20U);
}

TEST(Reproduce, FalsifiedDataFlipTheVerdict) {
  ModelPool pool(false);
  StudyOutcome outcome = run_study(study("four-spots-1khz"), {}, 2, pool);
  std::size_t flipped = 0;
  for (std::size_t i = 0; i < outcome.claims.size(); ++i) {
    if (outcome.claims[i].verdict != ClaimVerdict::kHolds) continue;
    // Spot 1 becomes spot 4 and the reverse, half a limit hotter, and never at its bound.
    std::vector<RunResult> false_data = outcome.results;
    std::swap(false_data.front().measures, false_data.back().measures);
    for (RunResult& run : false_data) {
      for (double& v : run.measures.at("overshoot_K")) v += 16.0;
      for (double& v : run.measures.at("estimate_overshoot_K")) v += 16.0;
      for (double& v : run.measures.at("late_mean_error_K")) v += 16.0;
      for (double& v : run.measures.at("saturated_until_ms")) v = -v;
    }
    const JudgedClaim judged = judge_claim(outcome.study, outcome.claims[i].claim, false_data);
    EXPECT_EQ(judged.verdict, ClaimVerdict::kDiffers) << judged.claim.text;
    flipped += judged.verdict == ClaimVerdict::kDiffers ? 1 : 0;
  }
  EXPECT_GE(flipped, 4U);
}

TEST(Reproduce, FalsifiedTrajectoriesFlipADifference) {
  ModelPool pool(false);
  StudyOutcome outcome = run_study(study("horizon-1khz"), {}, 1, pool);
  ASSERT_EQ(outcome.claims.front().verdict, ClaimVerdict::kHolds);
  for (RunResult& run : outcome.results) {
    if (run.id == "free_n20") run.trajectories.front().peak_K[3] += 1.0;
  }
  EXPECT_EQ(judge_claim(outcome.study, outcome.claims.front().claim, outcome.results).verdict,
            ClaimVerdict::kDiffers);
}

RunResult measured(const std::string& id, std::vector<double> values) {
  RunResult run;
  run.id = id;
  run.measures["x"] = std::move(values);
  return run;
}

// Ten seeds above the threshold, ten below: other seeds, another verdict.
TEST(Reproduce, AnIntervalOverTheThresholdIsUndecided) {
  std::vector<double> both(20, 0.0);
  for (std::size_t i = 0; i < 10; ++i) both[i] = 1.0;
  const std::vector<RunResult> results = {measured("split", both),
                                          measured("clear", std::vector<double>(20, 1.0))};
  const auto verdict = [&](const std::string& predicate) {
    return judge_claim({}, {.text = "x", .holds_if = predicate}, results).verdict;
  };
  EXPECT_EQ(verdict("mean(x, split) > 0.5"), ClaimVerdict::kUndecided);
  EXPECT_EQ(verdict("mean(x, clear) > 0.5"), ClaimVerdict::kHolds);
  EXPECT_EQ(verdict("mean(x, clear) < 0.5"), ClaimVerdict::kDiffers);
}

TEST(Reproduce, TheTruthIsJudgedBesideWhatIsSeen) {
  const JudgedClaim judged = judge_claim(
      {}, {.text = "x", .holds_if = "max(x, seen) <= 1", .in_truth = "max(x, true) <= 1"},
      {measured("seen", {0.5}), measured("true", {1.5})});
  EXPECT_EQ(judged.verdict, ClaimVerdict::kHolds);
  ASSERT_TRUE(judged.in_truth);
  EXPECT_EQ(*judged.in_truth, ClaimVerdict::kDiffers);
}

TEST(Reproduce, AClaimWhoseRunIsMissingCannotBeJudged) {
  const Claim claim{.text = "x",
                    .holds_if = "max(x, osqp) <= 1",
                    .cannot_judge = "not in this build",
                    .needs = "osqp"};
  EXPECT_EQ(judge_claim({}, claim, {measured("dense", {0.5})}).verdict, ClaimVerdict::kCannotJudge);
  EXPECT_EQ(judge_claim({}, claim, {measured("osqp", {0.5})}).verdict, ClaimVerdict::kHolds);
}

// The robust limit's proof is for the exact hold. What no claim says it needs may not be refused.
TEST(Reproduce, ARunThatAVariationRefusesIsLeftOutIfItsClaimSaysSo) {
  const std::vector<std::string> euler = {"model.discretization=implicit-euler",
                                          "grid.min_cells=2000", "run.duration_ms=20"};
  ModelPool pool(false);
  Study outlook = study("outlook");
  outlook.claims.erase(std::remove_if(outlook.claims.begin(), outlook.claims.end(),
                                      [](const Claim& c) { return c.needs != "robust_free"; }),
                       outlook.claims.end());
  ASSERT_EQ(outlook.claims.size(), 1U);
  const StudyOutcome varied = run_study(outlook, euler, 1, pool);
  EXPECT_EQ(varied.results.size(), outlook.runs.size() - 1);
  EXPECT_EQ(varied.claims.front().verdict, ClaimVerdict::kCannotJudge);
  outlook.claims.front().needs.clear();
  EXPECT_THROW(run_study(outlook, euler, 1, pool), Error);
}

// More seeds may decide what was open, but not turn a verdict round.
TEST(Reproduce, WithOtherSeedsOnlyTheOppositeIsUnexpected) {
  JudgedClaim judged;
  judged.claim.expected = "undecided";
  judged.verdict = ClaimVerdict::kDiffers;
  EXPECT_FALSE(judged.as_expected());
  judged.other_seeds = true;
  EXPECT_TRUE(judged.as_expected());
  judged.claim.expected = "holds";
  EXPECT_FALSE(judged.as_expected());
  judged.verdict = ClaimVerdict::kUndecided;
  EXPECT_TRUE(judged.as_expected());
}

TEST(Reproduce, AWrongPredicateNamesTheFileAndTheRun) {
  const Study one = study("four-spots-1khz");
  const Claim wrong{.text = "x", .holds_if = "max(peak_max_K, spot9) < 1"};
  try {
    judge_claim(one, wrong, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("four-spots-1khz.toml"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("spot9"), std::string::npos);
  }
}

TEST(Reproduce, ResultsDoNotDependOnOtherRuns) {
  ModelPool pool(false);
  const Study all = study("closed-loop-1khz");
  Study one = all;
  one.runs.erase(one.runs.begin() + 1, one.runs.end());
  one.claims.clear();
  const StudyOutcome a = run_study(all, {}, 2, pool);
  const StudyOutcome b = run_study(one, {}, 2, pool);
  EXPECT_EQ(a.results.front().trajectories[1].peak_K, b.results.front().trajectories[1].peak_K);
}

}  // namespace
}  // namespace photocoag
