// A campaign's journal has one writer at a time, and forgives what two have done to it once.
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>

#include "photocoag/campaign/journal.hpp"
#include "photocoag/campaign/run_campaign.hpp"
#include "photocoag/core/files.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::message_of;
using testing::TemporaryFolder;

Campaign small_campaign(const TemporaryFolder& folder) {
  write_file(folder.file("campaign.toml"),
             "spots = 6\nset = [\"run.duration_ms=20\", \"grid.min_cells=4000\"]\n[[input]]\n"
             "key = \"plant.absorption_factor\"\ndistribution = \"uniform\"\nlow = 0.4\n"
             "high = 1.4\n");
  return load_campaign(folder.file("campaign.toml"));
}

CampaignResult run(const Campaign& campaign, const TemporaryFolder& folder) {
  Ranks ranks;
  const std::atomic<bool> stop{false};
  return run_campaign(campaign, {.out = folder.path() / "out", .threads = 1, .use_cache = false},
                      ranks, stop);
}

std::vector<SpotRecord> spots_of(const Journal& journal) {
  std::vector<SpotRecord> all;
  journal.for_each([&all](const double* block) { all.push_back(from_block(block, 1)); });
  return all;
}

TEST(CampaignWriters, TheSecondIsRefusedWhileTheFirstRuns) {
  const TemporaryFolder folder;
  const Campaign campaign = small_campaign(folder);
  std::filesystem::create_directory(folder.path() / "out");
  {
    const Journal first(folder.path() / "out" / "journal.bin", campaign);
    const std::string message = message_of([&] { run(campaign, folder); });
    EXPECT_NE(message.find("journal.bin"), std::string::npos) << message;
    EXPECT_NE(message.find("another process"), std::string::npos) << message;
  }
  EXPECT_TRUE(run(campaign, folder).complete);
}

// What two writers left behind: spots twice, one that the campaign does not have.
TEST(CampaignWriters, SpotsThatAreThereTwiceCountOnce) {
  const TemporaryFolder folder;
  const Campaign campaign = small_campaign(folder);
  ASSERT_TRUE(run(campaign, folder).complete);
  const std::vector<SpotRecord> once =
      spots_of(Journal(folder.path() / "out" / "journal.bin", campaign));
  ASSERT_EQ(once.size(), 6U);
  {
    Journal journal(folder.path() / "out" / "journal.bin", campaign);
    journal.append(once[1]);
    journal.append(once[4]);
    SpotRecord foreign = once[0];
    foreign.spot = campaign.spots;
    journal.append(foreign);
    EXPECT_EQ(journal.spots().size(), 6U);
  }
  const CampaignResult again = run(campaign, folder);
  EXPECT_TRUE(again.complete);
  EXPECT_EQ(again.computed, 0U);
  EXPECT_EQ(again.journal->spots().size(), 6U);
  const std::vector<SpotRecord> spots = spots_of(*again.journal);
  ASSERT_EQ(spots.size(), once.size());
  for (std::size_t i = 0; i < once.size(); ++i) EXPECT_EQ(spots[i].spot, once[i].spot);
}

// Four processes that another MPI's launcher, or none, has started would each do everything.
TEST(CampaignWriters, ALauncherThatMpiDoesNotKnowIsRefused) {
  for (const char* variable : {"PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
    EXPECT_EXIT(
        {
          setenv(variable, "4", 1);
          const std::string message = message_of([] { Ranks(); });
          const bool told = message.find(variable) != std::string::npos &&
                            message.find("found 4") != std::string::npos;
          _exit(told ? 7 : 1);
        },
        ::testing::ExitedWithCode(7), "")
        << variable;
  }
}

}  // namespace
}  // namespace photocoag
