// `treat` as a user runs it, on a disk that another program fills while there is light.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "apps/program.hpp"
#include "support/small_disk.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kDisk = 4 << 20;
// 500 cycles of a light eye: 4 ms are long enough for a busy machine, and 2 s to fill the disk.
const std::string kTreatment =
    " --set control.period_ms=4 --set run.duration_ms=2000 --set plant.model=reduced --set "
    "grid.min_cells=2000 ";

/// Fills the disk once some records are in the log. False if the program was over before.
bool fill_during(const std::future<ProgramResult>& program, const fs::path& run,
                 const Ballast& ballast) {
  const fs::path segment = run / "log" / "000000.seg";
  std::error_code ignored;
  while (!fs::exists(segment, ignored) || fs::file_size(segment, ignored) < 20'000) {
    if (program.wait_for(std::chrono::milliseconds(2)) == std::future_status::ready) return false;
  }
  return ballast.fill();
}

void treat_on_filling_disk(const Sandbox& sandbox, const std::string& with_room) {
  const Ballast ballast(sandbox.path("disk/ballast"));
  const fs::path run = sandbox.path("disk/run");
  auto program = std::async(std::launch::async,
                            [&] { return sandbox.run("treat --out disk/run" + kTreatment); });
  ASSERT_TRUE(fill_during(program, run, ballast));
  const ProgramResult result = program.get();
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_NE(result.err.find("ALARM     the log is not complete"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("No space left"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("the run folder is not complete"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(run / "run.csv"));

  // No next treatment on this disk.
  const ProgramResult next = sandbox.run("treat --out disk/next" + kTreatment);
  EXPECT_EQ(next.exit_code, 2) << next.err;
  EXPECT_NE(next.err.find("No space left"), std::string::npos) << next.err;

  // With room again the log is a run folder, as far as it goes.
  ballast.release();
  const ProgramResult recovered = sandbox.run("convert disk/run --recover");
  ASSERT_EQ(recovered.exit_code, 0) << recovered.err;
  const Json log = Json::parse(read_all(run / "summary.json"))["log"];
  EXPECT_GT(log["written"], 0);
  EXPECT_GT(log["dropped"], 0) << result.err;
  EXPECT_EQ(log["produced"], log["written"].get<int>() + log["dropped"].get<int>());
  EXPECT_FALSE(log["alarm"].is_null());

  // The powers are those with room, unless the machine was too busy: bit for bit in tests/run.
  if (result.err.find(" 0 overruns") == std::string::npos) return;
  EXPECT_EQ(log["produced"], 500) << result.err;
  std::istringstream rows(read_all(run / "run.csv"));
  int count = -1;  // the names
  for (std::string row; std::getline(rows, row); ++count) {
    EXPECT_NE(with_room.find(row + '\n'), std::string::npos) << row;
  }
  EXPECT_EQ(log["written"], count);
}

TEST(FullDisk, TreatGoesOnSaysSoAndItsLogIsRecovered) {
  const Sandbox sandbox;
  ASSERT_EQ(sandbox.run("simulate --out roomy" + kTreatment).exit_code, 0);
  const std::string with_room = read_all(sandbox.path("roomy/run.csv"));
  fs::create_directory(sandbox.path("disk"));
  const SmallDiskOutcome disk = on_small_disk(sandbox.path("disk"), kDisk,
                                              [&] { treat_on_filling_disk(sandbox, with_room); });
  if (!disk.unsupported.empty()) GTEST_SKIP() << "no disk of its own: " << disk.unsupported;
  EXPECT_TRUE(disk.passed) << "in the child process, see above";
}

std::string reduced_eyes(int spots) {
  return "spots = " + std::to_string(spots) +
         "\nset = [\"plant.model=reduced\", \"grid.min_cells=2000\"]\n[[input]]\n"
         "key = \"plant.absorption_factor\"\ndistribution = \"uniform\"\nlow = 0.5\nhigh = 1.2\n";
}

void campaign_on_filling_disk(const Sandbox& sandbox) {
  // 360 bytes a spot.
  const ProgramResult large = sandbox.run("campaign large.toml --out disk/large");
  EXPECT_EQ(large.exit_code, 2) << large.err;
  EXPECT_NE(large.err.find("the disk has no room"), std::string::npos) << large.err;
  EXPECT_FALSE(fs::exists(sandbox.path("disk/large")));

  const Ballast ballast(sandbox.path("disk/ballast"));
  const fs::path journal = sandbox.path("disk/spots/journal.bin");
  auto program = std::async(std::launch::async, [&] {
    return sandbox.run("campaign spots.toml --out disk/spots --threads 1");
  });
  std::error_code ignored;
  while (!fs::exists(journal, ignored) || fs::file_size(journal, ignored) < 50'000) {
    ASSERT_NE(program.wait_for(std::chrono::milliseconds(2)), std::future_status::ready);
  }
  ASSERT_TRUE(ballast.fill());
  const ProgramResult result = program.get();
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_NE(result.err.find("journal.bin: cannot be written: No space left"), std::string::npos)
      << result.err;

  ballast.release();
  const ProgramResult rest = sandbox.run("campaign spots.toml --out disk/spots");
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_EQ(rest.err.find(" 3000 computed now"), std::string::npos) << rest.err;
  for (const std::string file : {"campaign.h5", "summary.json", "tables.md", "index.html"}) {
    EXPECT_EQ(read_all(sandbox.path("disk/spots/" + file)),
              read_all(sandbox.path("whole/" + file)));
  }
}

TEST(FullDisk, ACampaignThatDoesNotFitIsRefusedOneThatIsCutShortContinues) {
  const Sandbox sandbox;
  write_all(sandbox.path("spots.toml"), reduced_eyes(3000));
  write_all(sandbox.path("large.toml"), reduced_eyes(20'000));
  ASSERT_EQ(sandbox.run("campaign spots.toml --out whole").exit_code, 0);
  fs::create_directory(sandbox.path("disk"));
  const SmallDiskOutcome disk =
      on_small_disk(sandbox.path("disk"), kDisk, [&] { campaign_on_filling_disk(sandbox); });
  if (!disk.unsupported.empty()) GTEST_SKIP() << "no disk of its own: " << disk.unsupported;
  EXPECT_TRUE(disk.passed) << "in the child process, see above";
}

}  // namespace
}  // namespace photocoag::testing
