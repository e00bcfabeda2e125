// What treat leaves in its log is what it did; a run folder can be made from it.
#include <gtest/gtest.h>

#include <fstream>

#include "loop/treatments.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/run/recover.hpp"
#include "photocoag/run/run_csv.hpp"
#include "photocoag/run/run_folder.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

Treatment logged_treatment(const std::filesystem::path& folder, const Config& config,
                           const DeviceAddress& place, LogOptions options = {}) {
  ModelStore models(config, true);
  const std::atomic<bool> stop{false};
  std::atomic<std::size_t> progress{0};
  return run_treatment(config, models, place, stop, progress, folder / "log", std::move(options));
}

const std::vector<std::string> kShort = {"run.duration_ms=40", "grid.min_cells=2000"};

TEST(CycleLog, HoldsEveryCycleOfAPacedTreatment) {
  const TemporaryFolder folder;
  const Config config = shipped("paper-1khz.toml", kShort);
  const Treatment treatment = logged_treatment(folder.path(), config, DeviceAddress());
  const LogContent log = read_segments(segments_of(folder.path()));
  EXPECT_TRUE(log.closed);
  EXPECT_EQ(treatment.log.totals.produced, treatment.records.size());
  EXPECT_EQ(treatment.log.totals.dropped, 0u);
  EXPECT_TRUE(treatment.log.trouble.empty());
  EXPECT_EQ(run_csv(treatment_from(log)), run_csv(treatment));
  EXPECT_EQ(treatment_from(log).outcome.safety.state, SafetyState::kDone);
  // Each cycle once in every histogram, in the treatment and from the log.
  const CycleHistograms& own = treatment.histograms;
  for (const DurationHistogram* histogram :
       {&own.wake_late, &own.compute, &own.write, &own.slack}) {
    EXPECT_EQ(histogram->cycles(), treatment.records.size());
  }
  EXPECT_EQ(own.wake_late.negative(), 0u);
  EXPECT_EQ(treatment_from(log).histograms.slack.bins(), own.slack.bins());
}

TEST(CycleLog, ChangesNoPower) {
  const TemporaryFolder folder;
  const Config config = shipped("paper-1khz.toml", kShort);
  const Treatment with = logged_treatment(folder.path(), config, virtual_eye());
  ModelStore models(config, true);
  EXPECT_TRUE(same(with.records, treat(config, models).records));
}

TEST(CycleLog, MakesTheRunFolderAgain) {
  const TemporaryFolder folder;
  const Config config = shipped("paper-1khz.toml", kShort);
  std::ofstream(folder.path() / "config.toml") << to_toml(config);
  EXPECT_THROW(recover_run(folder.path()), Error) << "no log yet";
  const Treatment treatment = logged_treatment(folder.path(), config, virtual_eye());
  recover_run(folder.path());
  std::ifstream csv(folder.path() / "run.csv");
  const std::string text{std::istreambuf_iterator<char>(csv), {}};
  EXPECT_EQ(text, run_csv(treatment));
  std::ifstream summary(folder.path() / "summary.json");
  const std::string numbers{std::istreambuf_iterator<char>(summary), {}};
  EXPECT_NE(numbers.find("\"loop_wall_s\": null"), std::string::npos) << "a log does not tell";
  EXPECT_THROW(recover_run(folder.path()), Error) << "a complete run is not written over";
  std::filesystem::remove(folder.path() / "run.csv");
  std::ofstream(folder.path() / "config.toml") << to_toml(shipped("paper-1khz.toml"));
  EXPECT_THROW(recover_run(folder.path()), Error) << "another configuration";
}

TEST(CycleLog, OfAKilledProgramSaysSo) {
  LogContent log;
  log.header.period = 1e-3;
  LogRecord record;
  record.safety = SafetyState::kTreating;
  log.records = {record};
  Treatment treatment = treatment_from(log);
  EXPECT_TRUE(treatment.recovered);
  EXPECT_NE(summarize(shipped("paper-1khz.toml"), treatment).stopped_for.find("ended early"),
            std::string::npos);
  EXPECT_FALSE(treatment.log.trouble.empty());
  // Out-of-range codes and an absurd period: no crash, no gigabytes.
  log.header.period = 1e9;
  field_named("solver_status")->set(log.records[0], static_cast<std::uint64_t>(-1));
  field_named("safety_state")->set(log.records[0], 99);
  field_named("stop_reason")->set(log.records[0], std::uint64_t{1} << 62U);
  EXPECT_EQ(log.records[0].decision.status, MpcStatus{});
  EXPECT_EQ(log.records[0].safety, SafetyState{});
  EXPECT_EQ(log.records[0].end.safety.reason, SafetyReason{});
  treatment = treatment_from(log);
  EXPECT_FALSE(run_csv(treatment).empty());
  EXPECT_TRUE(treatment.histograms.slack.bins().empty());
}

TEST(CycleLog, AFullDiskIsAnAlarmAndNothingElse) {
  const TemporaryFolder folder;
  const Config config = shipped("paper-1khz.toml", kShort);
  int calls = 0;
  const Treatment treatment =
      logged_treatment(folder.path(), config, virtual_eye(),
                       {.write = [&](int file, const void* bytes, std::size_t size) -> ssize_t {
                         if (calls++ == 0) return ::write(file, bytes, size);
                         errno = ENOSPC;
                         return -1;
                       }});
  EXPECT_EQ(treatment.records.size(), 40u);
  EXPECT_FALSE(treatment.outcome.stopped);
  EXPECT_EQ(treatment.log.totals.dropped, 40u);
  EXPECT_FALSE(treatment.log.trouble.empty());
}

}  // namespace
}  // namespace photocoag::testing
