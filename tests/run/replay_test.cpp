// A recorded run reproduces its powers bit for bit, and a changed sample is seen.
#include "photocoag/run/replay.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "loop/treatments.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/run/run_csv.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

const std::vector<std::string> kSmall = {"grid.min_cells=2000", "run.duration_ms=80"};

Treatment record(const std::filesystem::path& folder, const std::vector<std::string>& overrides,
                 ModelStore& models) {
  const Config config = shipped("paper-1khz.toml", overrides);
  const Treatment treatment = treat(config, models);
  const ClaimedFolder claimed = open_run_folder(folder, config);
  write_run(folder, config, treatment);
  return treatment;
}

Treatment record(const std::filesystem::path& folder, const std::vector<std::string>& overrides) {
  ModelStore models(shipped("paper-1khz.toml", overrides), true);
  return record(folder, overrides, models);
}

TEST(Replay, PowersAreTheSameToTheLastBit) {
  const TemporaryFolder folder;
  ModelStore models(shipped("paper-1khz.toml", kSmall), true);  // no model depends on the extras
  for (const std::string extra :
       {"safety.supervisor=on", "safety.supervisor=off", "safety.real_time=enforce",
        "safety.exposure_max_ms=30", "plant.noise_K=1"}) {
    std::vector<std::string> overrides = kSmall;
    overrides.push_back(extra);
    const std::filesystem::path run = folder.path() / extra;
    const Treatment treatment = record(run, overrides, models);
    const ReplayOutcome outcome = replay_run(run, false);
    EXPECT_TRUE(outcome.same()) << extra << ", cycle " << outcome.differs_at;
    // Every power of the run but the 0 W after its end.
    EXPECT_EQ(outcome.compared, treatment.records.size()) << extra;
  }
}

// The first power that is applied is the second row's, and the last one that is written is nowhere.
TEST(Replay, WithADelayToo) {
  const TemporaryFolder folder;
  for (const std::string extra : {"control.period_ms=1", "estimator.kind=mhe"}) {
    std::vector<std::string> overrides = kSmall;
    for (const std::string& key : {std::string("control.delay_cycles=1"), extra}) {
      overrides.push_back(key);
    }
    const std::filesystem::path run = folder.path() / extra;
    const Treatment treatment = record(run, overrides);
    const ReplayOutcome outcome = replay_run(run, false);
    EXPECT_TRUE(outcome.same()) << extra << ", cycle " << outcome.differs_at;
    EXPECT_EQ(outcome.compared, treatment.records.size() - 1);
  }
}

#if PHOTOCOAG_HAS_OSQP
TEST(Replay, WithTheRunsOwnSolver) {
  const TemporaryFolder folder;
  for (const std::string solver : {"osqp", "osqp-condensed"}) {
    std::vector<std::string> overrides = kSmall;
    for (const std::string& key : {"control.solver=" + solver, std::string("control.horizon=20")}) {
      overrides.push_back(key);
    }
    const std::filesystem::path run = folder.path() / solver;
    record(run, overrides);
    const ReplayOutcome outcome = replay_run(run, false);
    EXPECT_TRUE(outcome.same()) << solver << ", cycle " << outcome.differs_at;
  }
}
#endif

TEST(Replay, TwoUnknownsToo) {
  const TemporaryFolder folder;
  const std::filesystem::path run = folder.path() / "two";
  std::vector<std::string> overrides = kSmall;
  for (const char* extra :
       {"tissue.layers.choroid.scaled_by=beta", "estimator.unknowns=rpe-and-choroid",
        "estimator.kind=mhe", "plant.choroid_factor=0.7"}) {
    overrides.emplace_back(extra);
  }
  record(run, overrides);
  EXPECT_TRUE(replay_run(run, false).same());
}

TEST(Replay, ARunThatWasBackedOffIsReplayedBackedOff) {
  const TemporaryFolder folder;
  std::vector<std::string> overrides = kSmall;
  overrides.emplace_back("uncertainty.spot_radius_relative=0.1");
  const Config asked = shipped("paper-1khz.toml", overrides);
  ModelStore models(asked, true);
  const TissueMargin margin = tissue_margin(asked, models.reduced());
  ASSERT_TRUE(margin.needed());
  const Treatment treatment = treat(backed_off(asked, margin), models);
  const ClaimedFolder claimed = open_run_folder(folder.path() / "run", asked);
  write_run(folder.path() / "run", asked, treatment);
  EXPECT_TRUE(replay_run(folder.path() / "run", false).same());
}

TEST(Replay, AChangedSampleIsSeen) {
  const TemporaryFolder folder;
  const std::filesystem::path run = folder.path() / "run";
  record(run, kSmall);
  const std::string file = (run / "run.csv").string();
  std::string csv = read_file(file, 1 << 20);
  // The sixth row's measured value: one digit in the middle of it.
  std::size_t at = 0;
  for (int line = 0; line < 6; ++line) at = csv.find('\n', at) + 1;
  for (int comma = 0; comma < 4; ++comma) at = csv.find(',', at) + 1;
  char& digit = csv[at + 5];
  digit = digit == '5' ? '6' : '5';
  write_file(file, csv);
  const ReplayOutcome outcome = replay_run(run, false);
  EXPECT_FALSE(outcome.same());
  EXPECT_EQ(outcome.differs_at, 6u) << "the power after the changed sample of cycle 5";
}

TEST(Replay, DamagedFilesNameTheLine) {
  const TemporaryFolder folder;
  const std::filesystem::path run = folder.path() / "run";
  record(run, kSmall);
  const std::string file = (run / "run.csv").string();
  const std::string csv = read_file(file, 1 << 20);
  for (const std::size_t length : {csv.size() - 20, csv.size() / 2}) {
    write_file(file, csv.substr(0, length));
    EXPECT_THROW(replay_of(read_run_csv(file), 1e-3), std::exception) << length;
  }
  write_file(file, "");
  EXPECT_TRUE(replay_of(read_run_csv(file), 1e-3).empty());
}

}  // namespace
}  // namespace photocoag::testing
