// What explains the experiments: the file, repetitions, readings of the peak, the lag that is
// found.
#include "photocoag/study/explain.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "photocoag/core/error.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

const fs::path kSearch = fs::path(PHOTOCOAG_SOURCE_DIR) / "studies/experiments/250hz.toml";

// One run of the paper's experiments on a bench of which the estimator knows nothing.
std::vector<std::string> bench(double sample_lag) {
  return {"safety.supervisor=off",
          "control.period_ms=4",
          "control.horizon=5",
          "control.first_power_W=0.02",
          "run.duration_ms=200",
          "plant.model=reduced",
          "plant.absorption_factor=0.75",
          "tissue.transmission=0.65",
          "grid.min_cells=4000",
          "plant.sample_lag_periods=" + std::to_string(sample_lag)};
}

// One for all: they share the models.
ModelPool& pool() {
  static ModelPool models(false);
  return models;
}

RunResult run_with(std::vector<std::string> set, const std::string& weight, int seeds) {
  set.push_back(weight);
  return run_all({{"r1", load_config("", set)}}, seeds, pool()).front();
}

TEST(Explain, TheShippedSearchHasThePapersElevenStatements) {
  const Explanation study = load_explanation(kSearch);
  EXPECT_EQ(study.statements.size(), 11U);
  EXPECT_EQ(study.runs.size(), 5U);
  for (const RunJob& job : explained_jobs(study, {}, 0))
    EXPECT_TRUE(job.config.control.first_power);
  // Every level of every factor and every remedy is a configuration.
  for (const Factor& factor : study.factors) {
    for (const LabelledSet& level : factor.levels) {
      EXPECT_NO_THROW(explained_jobs(study, level.set, 0)) << factor.id << " " << level.label;
    }
  }
  for (const RemedyPlan& remedy : study.remedies) {
    EXPECT_NO_THROW(explained_jobs(study, remedy.does.set, 0)) << remedy.does.label;
  }
}

TEST(Explain, TreatmentsOfARepetitionHaveNoiseOfTheirOwn) {
  const std::vector<RunJob> jobs = explained_jobs(load_explanation(kSearch), {}, 3);
  for (std::size_t i = 1; i < jobs.size(); ++i) {
    EXPECT_GE(jobs[i].config.run.seed, jobs[i - 1].config.run.seed + 10'000U);
  }
}

void expect_refused(const std::string& from, const std::string& to, const std::string& key) {
  const testing::TemporaryFolder folder;
  std::ifstream in(kSearch);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  ASSERT_NE(text.find(from), std::string::npos) << from;
  text.replace(text.find(from), from.size(), to);
  const fs::path file = folder.path() / "search.toml";
  std::ofstream(file) << text;
  try {
    load_explanation(file);
    FAIL() << to;
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("search.toml"), std::string::npos) << what;
    EXPECT_NE(what.find(key), std::string::npos) << what;
    EXPECT_NE(what.find("accepted"), std::string::npos) << what;
  }
}

TEST(Explain, ABadFileIsRefusedWithKeyAndWhatIsAccepted) {
  expect_refused("lag_run       = \"cool_r1\"", "lag_run = \"r9\"", "lag_run");
  expect_refused("scan_factor   = \"transmission\"", "scan_factor = \"colour\"", "scan_factor");
  expect_refused("told  = \"found\"", "told = \"guessed\"", "told");
  expect_refused("more  = 0.2", "more = 2", "more");
  expect_refused("change = \"alone\"", "change = \"twice\"", "change");
  expect_refused("best_sets     = 6", "best_sets = \"four\"", "best_sets");
  expect_refused("confirm_seeds", "confirm_sedes", "confirm_sedes");
}

RunResult with_values(const std::string& id, std::vector<double> seen, std::vector<double> truth) {
  RunResult run;
  run.id = id;
  run.trajectories.resize(seen.size());
  run.measures["estimate_over_limit_K"] = std::move(seen);
  run.measures["over_limit_K"] = std::move(truth);
  return run;
}

TEST(Explain, EveryRepetitionIsJudgedByItself) {
  Explanation study;
  study.statements.resize(2);
  study.statements[0].holds_if = "median(estimate_over_limit_K, r2) > 0";
  study.statements[0].in_truth = "median(over_limit_K, r2) > 0";
  study.statements[1].holds_if = "max(estimate_over_limit_K, r2) <= 2";
  const Repetitions all =
      judge_repetitions(study, {with_values("r2", {-1.0, 1.0, 1.5, 3.0}, {1.0, 2.0, 3.0, 4.0})});
  ASSERT_EQ(all.count(), 4U);
  EXPECT_EQ(all.share(0), 0.75);
  EXPECT_EQ(all.true_share(0), 1.0);
  EXPECT_EQ(all.share(1), 0.75);
  EXPECT_EQ(all.true_share(1), 0.75);  // without a predicate of its own: as seen
  EXPECT_EQ(all.mean_held(), 1.5);
  EXPECT_EQ(all.with_at_least(2), 2U);
}

// Alpha known and the eye the model: the model under the recorded powers is the eye.
TEST(Explain, AfterwardsAKnownEyeIsReadAsItWas) {
  std::vector<std::string> set = bench(0.0);
  set.push_back("estimator.absorption_initial=0.75");
  set.push_back("estimator.absorption_sigma_initial=1e-6");
  const RunResult run = run_with(set, "control.power_weight=5e4", 1);
  const RunResult read = reread(run, PeakReading::kAfterwards, pool().get(run.config)->reduced);
  const Trajectory& loop = read.trajectories.front();
  // 1e-3 K: alpha drifts by its process noise.
  for (std::size_t k = 0; k < loop.peak_K.size(); ++k) {
    ASSERT_NEAR(loop.peak_estimate_K[k], loop.peak_K[k], 1e-3) << k;
  }
  EXPECT_NEAR(read.measures.at("estimate_over_limit_K").front(),
              run.measures.at("over_limit_K").front(), 1e-3);
}

TEST(Explain, TheReplayOfOneTreatmentFindsTheLag) {
  for (const double lag : {0.0, 0.3, 0.7}) {
    const RunResult run = run_with(bench(lag), "control.power_weight=5e4", 1);
    const ReducedModel& model = pool().get(run.config)->reduced;
    const auto misfit = [&](double told) {
      return replay_misfit(model, run.config.estimator, told, run.trajectories.front());
    };
    for (const double other : {0.0, 0.3, 0.5, 0.7, 0.9}) {
      if (other == lag) continue;
      EXPECT_LT(misfit(lag), misfit(other)) << lag << " told " << other;
    }
  }
}

// The answer to an unknown lag, in closed loop: measure it in a treatment that is harmless, tell
// it.
TEST(Explain, ToldTheFoundLagTheLimitHolds) {
  Explanation study;
  study.set = bench(0.7);
  study.runs.resize(2);
  study.runs[0].id = study.lag_run = "r1";
  study.runs[0].set = {"control.power_weight=5e4"};
  study.runs[1].id = study.hot_run = "r2";
  study.runs[1].set = {"control.power_change_weight=5e4"};
  study.statements.resize(1);
  study.statements[0].holds_if = "max(over_limit_K, r2) > 0";
  study.lags = {0.0, 0.35, 0.7};
  const LabelledSet told_nothing{"told nothing", {"control.power_change_weight=5e4"}};
  study.remedies = {
      {told_nothing, false, 0.0}, {told_nothing, true, 0.0}, {told_nothing, true, 0.2}};
  const ConfirmedSet set = confirm(study, {"bench", {}}, 3, pool());
  EXPECT_EQ(set.found_lags, (std::vector<double>{0.7, 0.7, 0.7}));
  EXPECT_NEAR(set.true_lag, 0.7, 1e-12);
  EXPECT_EQ(set.repetitions().share(0), 1.0);
  const std::vector<Remedy> remedies = try_remedies(study, {}, set, pool());
  EXPECT_EQ(remedies[0].over, 3U);
  EXPECT_EQ(remedies[1].over, 0U);
  EXPECT_LT(remedies[1].true_K, 31.0);
  // Told too much it is only slower.
  EXPECT_EQ(remedies[2].over, 0U);
  EXPECT_GE(remedies[2].time_to_95_ms, remedies[1].time_to_95_ms);
}

// Of sets that tie in the search the first is not the best one: here a statement holds by the luck
// of the noise, more often the later the sample is.
TEST(Explain, TheBestSetIsTheBestOfTheConfirmedOnes) {
  Explanation study;
  study.set = bench(0.0);
  study.seeds = 1;
  study.confirm_seeds = 8;
  study.best_sets = 3;
  study.runs.resize(1);
  study.runs[0].id = study.hot_run = study.lag_run = "r2";
  study.runs[0].set = {"control.power_change_weight=5e4"};
  study.statements.resize(1);
  study.statements[0].holds_if = "max(over_limit_K, r2) > 1";
  study.lags = {0.0, 0.5};
  study.factors = {{.id = "timing",
                    .title = "late",
                    .levels = {{"at once", {}},
                               {"0.5", {"plant.sample_lag_periods=0.5"}},
                               {"0.7", {"plant.sample_lag_periods=0.7"}}}}};
  study.scan_factor = "timing";
  const ExplainOutcome outcome = explain(study, false, false);
  ASSERT_EQ(outcome.confirmed.size(), 3U);
  const auto mean = [&](std::size_t k) { return outcome.confirmed[k].repetitions().mean_held(); };
  EXPECT_GT(mean(0), mean(1));
  EXPECT_GT(mean(0), mean(2));
  EXPECT_EQ(outcome.confirmed[0].label, "late: 0.7");
  // The search itself took another one first.
  EXPECT_NE(outcome.together.front().levels, std::vector<std::size_t>{2});
  // What is drawn, varied and remedied is the best one.
  EXPECT_EQ(outcome.around.front().levels, std::vector<std::size_t>{2});
  EXPECT_FALSE(outcome.confirmed[0].runs.empty());
  EXPECT_TRUE(outcome.confirmed[1].runs.empty());
}

}  // namespace
}  // namespace photocoag
