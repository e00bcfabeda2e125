// What a campaign has computed comes to the disk while it runs; a disk that cannot is an error.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <thread>

#include "photocoag/campaign/journal.hpp"
#include "photocoag/core/files.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace {

std::atomic<int> refused_with{0};
std::atomic<off_t> bytes_on_disk{0};
constexpr auto kSlow = std::chrono::milliseconds(50);  // for all who do not wait to be seen

}  // namespace

// In place of the C library's.
extern "C" int fdatasync(int file) {
  if (refused_with != 0) {
    errno = refused_with;
    return -1;
  }
  std::this_thread::sleep_for(kSlow);
  struct stat now {};
  fstat(file, &now);
  bytes_on_disk = now.st_size;
  return 0;
}

namespace photocoag {
namespace {

using testing::message_of;
using testing::TemporaryFolder;

class PowerCut : public ::testing::Test {
 protected:
  PowerCut() {
    refused_with = 0;
    bytes_on_disk = 0;
    write_file(folder_.file("campaign.toml"),
               "spots = 2\nset = [\"plant.model=reduced\"]\n[[input]]\n"
               "key = \"plant.absorption_factor\"\ndistribution = \"uniform\"\nlow = 0.4\n"
               "high = 1.4\n");
    campaign_ = load_campaign(folder_.file("campaign.toml"));
  }
  // What the constructor begins is over: what comes to the disk later is another's doing.
  void settle() const {
    while (bytes_on_disk == 0) std::this_thread::sleep_for(kSlow);
  }
  std::filesystem::path file() const { return folder_.path() / "journal.bin"; }
  off_t bytes() const { return static_cast<off_t>(std::filesystem::file_size(file())); }
  static SpotRecord record(std::uint64_t spot) {
    SpotRecord one;
    one.spot = spot;
    one.inputs = {1.0};
    one.outcomes.resize(outcome_columns().size());
    return one;
  }

  TemporaryFolder folder_;
  Campaign campaign_;
};

TEST_F(PowerCut, ComputedSpotsComeToTheDiskWhileOthersAreComputed) {
  Journal journal(file(), campaign_);
  settle();
  journal.append(record(0));
  const off_t first = bytes();
  for (int i = 0; i < 600 && bytes_on_disk < first; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    journal.append(record(0));
  }
  EXPECT_GE(bytes_on_disk, first);
}

TEST_F(PowerCut, TheLastSpotIsOnTheDiskWhenItIsTaken) {
  Journal journal(file(), campaign_);
  settle();
  journal.append(record(1));
  journal.append(record(0));
  EXPECT_EQ(bytes_on_disk, bytes());
}

TEST_F(PowerCut, AnInterruptedCampaignIsOnTheDiskWhenItEnds) {
  {
    Journal journal(file(), campaign_);
    settle();
    journal.append(record(1));
  }
  EXPECT_EQ(bytes_on_disk, bytes());
}

TEST_F(PowerCut, ADiskThatCannotIsAnError) {
  Journal journal(file(), campaign_);
  journal.append(record(1));
  refused_with = EIO;
  const std::string message = message_of([&] { journal.append(record(0)); });
  EXPECT_NE(message.find("cannot be flushed to the disk"), std::string::npos) << message;
}

TEST_F(PowerCut, AFileThatIsOnNoDiskIsNone) {
  refused_with = EINVAL;
  Journal journal(file(), campaign_);
  journal.append(record(1));
  journal.append(record(0));
  EXPECT_EQ(journal.spots().size(), 2U);
}

}  // namespace
}  // namespace photocoag
