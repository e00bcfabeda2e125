// A whole treatment whose disk becomes really full: the same powers, exact counts, an alarm, and a
// log from which what was written comes out again.
#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>

#include "loop/treatments.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/run/recover.hpp"
#include "photocoag/run/run_csv.hpp"
#include "photocoag/run/run_folder.hpp"
#include "support/small_disk.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDisk = 1 << 20;  // 400 cycles are 163 KB, of which twice must be free

std::string text_of(const fs::path& file) { return read_file(file.string(), kDisk); }

/// The treatment with a log on a disk that is full from the second block on.
Treatment on_filling_disk(const Config& config, ModelStore& models, const fs::path& run,
                          const Ballast& ballast) {
  const std::atomic<bool> stop{false};
  std::atomic<std::size_t> progress{0};
  int calls = 0;
  // Somebody else fills the disk; then the kernel answers to the log's own write. 800 cycles are at
  // least 4 blocks: some follow, and there is no room for them.
  LogOptions options{.write = [&](int file, const void* bytes, std::size_t size) -> ssize_t {
    if (++calls == 3) {
      EXPECT_TRUE(ballast.fill());
    }
    return ::write(file, bytes, size);
  }};
  return run_treatment(config, models, virtual_eye(), stop, progress, run / "log",
                       std::move(options));
}

TEST(TreatmentOnAFullDisk, HasTheSamePowersExactCountsAndAnAlarm) {
  const Config config = shipped("paper-1khz.toml", {"run.duration_ms=800", "grid.min_cells=2000"});
  ModelStore models(config, true);
  const Treatment expected = treat(config, models);
  ASSERT_EQ(expected.records.size(), 800U);
  const TemporaryFolder folder;
  const SmallDiskOutcome disk = on_small_disk(folder.path(), kDisk, [&] {
    const Ballast ballast(folder.path() / "ballast");
    const fs::path run = folder.path() / "run";
    const ClaimedFolder claimed = open_run_folder(run, config);
    const Treatment treatment = on_filling_disk(config, models, run, ballast);
    EXPECT_TRUE(same(treatment.records, expected.records)) << "bit for bit";
    EXPECT_FALSE(treatment.outcome.stopped);
    const LogTotals& totals = treatment.log.totals;
    EXPECT_EQ(totals.produced, treatment.records.size());
    EXPECT_EQ(totals.produced, totals.written + totals.dropped);
    EXPECT_GT(totals.written, 0U);
    EXPECT_GT(totals.dropped, 0U);
    EXPECT_NE(treatment.log.trouble.find("No space"), std::string::npos) << treatment.log.trouble;

    // The run folder cannot be written either; nothing half stays in it.
    EXPECT_THROW(write_run(run, config, treatment), Error);
    EXPECT_FALSE(fs::exists(run / "run.csv"));
    // What was written before is readable while the disk is still full.
    const LogContent log = read_segments(segments_of(run));
    EXPECT_EQ(log.records.size(), totals.written);
    EXPECT_EQ(log.bad_bytes, 0U);
    for (const LogRecord& record : log.records) {
      const auto cycle = static_cast<std::size_t>(record.cycle);
      EXPECT_TRUE(same(record.power, expected.records.at(cycle).power)) << cycle;
    }

    // With room again the log makes the run folder, as far as it goes, and says what is missing.
    ballast.release();
    recover_run(run);
    const std::string summary = text_of(run / "summary.json");
    EXPECT_NE(summary.find("\"dropped\": " + std::to_string(totals.dropped)), std::string::npos);
    EXPECT_NE(summary.find(std::to_string(totals.dropped) + " of 800 records are not in the log"),
              std::string::npos)
        << summary;
    // A last block of a few records may have found room in a page that was begun before.
    const bool end_is_known = log.records.back().cycle == 799;
    EXPECT_EQ(summary.find("\"stopped_for\": null") != std::string::npos, end_is_known) << summary;
    // Each row that is there is the row of the treatment with room.
    std::istringstream rows(text_of(run / "run.csv"));
    const std::string all = run_csv(expected);
    std::string row;
    std::size_t count = 0;
    for (; std::getline(rows, row); ++count) {
      EXPECT_NE(all.find(row + '\n'), std::string::npos) << row;
    }
    EXPECT_EQ(count, 1 + totals.written);
    EXPECT_THROW(recover_run(run), Error) << "it is there now";
    // Full between run.csv and summary.json: the table stays, the summary is made.
    const std::string table = text_of(run / "run.csv") + "a longer table\n";
    write_file((run / "run.csv").string(), table);
    fs::remove(run / "summary.json");
    recover_run(run);
    EXPECT_EQ(text_of(run / "run.csv"), table);
    EXPECT_TRUE(fs::exists(run / "summary.json"));
  });
  if (!disk.unsupported.empty()) GTEST_SKIP() << "no disk of its own: " << disk.unsupported;
  EXPECT_TRUE(disk.passed) << "in the child process, see above";
}

TEST(TreatmentOnAFullDisk, WithRoomAtItsEndTheRunFolderIsCompleteAndHasTheAlarm) {
  const Config config = shipped("paper-1khz.toml", {"run.duration_ms=800", "grid.min_cells=2000"});
  ModelStore models(config, true);
  const std::string expected = run_csv(treat(config, models));
  const TemporaryFolder folder;
  const SmallDiskOutcome disk = on_small_disk(folder.path(), kDisk, [&] {
    const Ballast ballast(folder.path() / "ballast");
    const fs::path run = folder.path() / "run";
    const ClaimedFolder claimed = open_run_folder(run, config);
    const Treatment treatment = on_filling_disk(config, models, run, ballast);
    ballast.release();
    write_run(run, config, treatment);
    EXPECT_EQ(text_of(run / "run.csv"), expected);
    const std::string summary = text_of(run / "summary.json");
    EXPECT_NE(summary.find("could not be written: No space"), std::string::npos) << summary;
    EXPECT_EQ(summary.find("\"dropped\": 0"), std::string::npos) << summary;
  });
  if (!disk.unsupported.empty()) GTEST_SKIP() << "no disk of its own: " << disk.unsupported;
  EXPECT_TRUE(disk.passed) << "in the child process, see above";
}

}  // namespace
}  // namespace photocoag::testing
