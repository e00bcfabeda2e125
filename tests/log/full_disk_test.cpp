// The log on a disk that is really full: the kernel says so, not a hook.
#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>

#include "log/segments.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "support/small_disk.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

constexpr std::size_t kDisk = 512 * 1024;

LogContent content_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  return read_segments(files);
}

void produce(LogWriter& log, std::int64_t first, std::int64_t end) {
  for (std::int64_t k = first; k < end; ++k) {
    LogRecord record = record_of(k);
    log.record(record);
  }
}

/// Every record is one that was produced, whole and in its place.
void expect_as_produced(const LogContent& content) {
  std::int64_t before = -1;
  for (const LogRecord& record : content.records) {
    EXPECT_GT(record.record, before);
    before = record.record;
    LogRecord expected = record_of(record.record);
    expected.record = record.record;
    EXPECT_EQ(packed(record), packed(expected)) << record.record;
  }
}

/// Waits until the writer has met the full disk; it looks every 10 ms.
bool until_in_trouble(const LogWriter& log) {
  const std::int64_t patience = monotonic_ns() + 60'000'000'000;
  while (log.healthy() && monotonic_ns() < patience) wait_until(monotonic_ns() + 1'000'000);
  return !log.healthy();
}

/// Waits until the log of `folder` holds so many records.
bool until_written(const std::filesystem::path& folder, std::size_t records) {
  const std::int64_t patience = monotonic_ns() + 60'000'000'000;
  while (content_of(folder).records.size() < records && monotonic_ns() < patience) {
    wait_until(monotonic_ns() + 1'000'000);
  }
  return content_of(folder).records.size() >= records;
}

TEST(LogOnAFullDisk, CountsExactlyAndKeepsWhatWasWritten) {
  const TemporaryFolder folder;
  const SmallDiskOutcome disk = on_small_disk(folder.path(), kDisk, [&] {
    constexpr std::int64_t kRecords = 3000;  // 1.2 MB
    ASSERT_GT(kRecords * log_record_bytes(), 2 * kDisk);
    LogWriter log(folder.path() / "log", header(), {.ring_records = 4096, .write = {}});
    produce(log, 0, kRecords);
    const LogTotals totals = log.close();
    EXPECT_FALSE(log.healthy());
    EXPECT_NE(log.trouble().find("No space"), std::string::npos) << log.trouble();
    EXPECT_EQ(totals.produced, static_cast<std::uint64_t>(kRecords));
    EXPECT_EQ(totals.produced, totals.written + totals.dropped);
    // All the room was used but for less than one block of 256 records, header and folder.
    EXPECT_LE(totals.written * log_record_bytes(), kDisk);
    EXPECT_GT((totals.written + kBlockRecords) * log_record_bytes() + 16384, kDisk);
    const LogContent content = content_of(folder.path() / "log");
    EXPECT_TRUE(content.closed);
    EXPECT_EQ(content.totals, totals) << "the log itself says what it lost";
    EXPECT_EQ(content.records.size(), totals.written);
    EXPECT_EQ(content.bad_bytes, 0U) << "no half block stays";
    expect_as_produced(content);
  });
  if (!disk.unsupported.empty()) GTEST_SKIP() << "no disk of its own: " << disk.unsupported;
  EXPECT_TRUE(disk.passed) << "in the child process, see above";
}

// The block that says what was lost has its room, wherever in a page the last record ends and
// even when a new segment cannot be begun.
TEST(LogOnAFullDisk, SaysWhatItLostWhereverTheDiskEnds) {
  for (const std::size_t segment_bytes : {std::size_t{64} << 20, std::size_t{1} << 17}) {
    for (std::int64_t taken = 0; taken < 12; ++taken) {
      const TemporaryFolder folder;
      const SmallDiskOutcome disk = on_small_disk(folder.path(), kDisk, [&] {
        LogOptions options{.ring_records = 4096, .segment_bytes = segment_bytes, .write = {}};
        LogWriter log(folder.path() / "log", header(), options);
        produce(log, 0, 300 + taken);
        ASSERT_TRUE(until_written(folder.path() / "log", 300U + static_cast<std::size_t>(taken)));
        ASSERT_TRUE(Ballast(folder.path() / "ballast").fill());
        produce(log, 300 + taken, 1500);
        const LogTotals totals = log.close();
        const LogContent content = content_of(folder.path() / "log");
        EXPECT_TRUE(content.closed) << taken;
        EXPECT_EQ(content.totals, totals) << taken;
        EXPECT_GT(totals.dropped, 0U);
        EXPECT_EQ(content.records.size(), totals.written);
        EXPECT_EQ(content.bad_bytes, 0U);
      });
      if (!disk.unsupported.empty()) GTEST_SKIP() << "no disk of its own: " << disk.unsupported;
      EXPECT_TRUE(disk.passed) << "in the child process, see above";
    }
  }
}

// A limit of the file's size, too: reached in the room of the last block.
TEST(LogOnAFullDisk, SaysWhatItLostWhereverTheFileMustEnd) {
  for (std::size_t left = 0; left <= sizeof(BlockHeader); left += 8) {
    const TemporaryFolder folder;
    const std::filesystem::path log_folder = folder.path() / "log";
    const auto child = [&] {
      std::signal(SIGXFSZ, SIG_IGN);
      LogWriter log(log_folder, header(), {.ring_records = 4096, .write = {}});
      produce(log, 0, 20);
      if (!until_written(log_folder, 20)) return false;
      std::size_t limit = sizeof(BlockHeader) + 50 * log_record_bytes() + left;
      for (const auto& file : std::filesystem::directory_iterator(log_folder)) {
        limit += file.file_size();
      }
      const rlimit size{limit, limit};
      if (::setrlimit(RLIMIT_FSIZE, &size) != 0) return false;
      produce(log, 20, 70);
      wait_until(monotonic_ns() + 50'000'000);
      produce(log, 70, 200);
      return log.close().dropped > 0;
    };
    const pid_t process = ::fork();
    ASSERT_GE(process, 0);
    if (process == 0) _exit(child() ? 0 : 1);
    int status = 1;
    ASSERT_EQ(::waitpid(process, &status, 0), process);
    ASSERT_EQ(status, 0) << left;
    const LogContent content = content_of(log_folder);
    EXPECT_TRUE(content.closed) << left;
    EXPECT_GT(content.totals.dropped, 0U) << left;
    EXPECT_EQ(content.records.size(), content.totals.written) << left;
    EXPECT_EQ(content.bad_bytes, 0U) << left;
  }
}

TEST(LogOnAFullDisk, GoesOnWhenThereIsRoomAgain) {
  const TemporaryFolder folder;
  const SmallDiskOutcome disk = on_small_disk(folder.path(), kDisk, [&] {
    const Ballast ballast(folder.path() / "ballast");
    LogWriter log(folder.path() / "log", header(), {.ring_records = 4096, .write = {}});
    ASSERT_TRUE(ballast.fill());
    produce(log, 0, 600);
    ASSERT_TRUE(until_in_trouble(log));
    ballast.release();
    produce(log, 600, 1000);
    const LogTotals totals = log.close();
    EXPECT_EQ(totals.produced, 1000U);
    EXPECT_EQ(totals.produced, totals.written + totals.dropped);
    EXPECT_GT(totals.dropped, 0U);
    EXPECT_GE(totals.written, 400U) << "what came after the room";
    const LogContent content = content_of(folder.path() / "log");
    EXPECT_TRUE(content.closed);
    EXPECT_EQ(content.totals, totals) << "the log itself says what it lost";
    EXPECT_EQ(content.records.size(), totals.written);
    EXPECT_EQ(content.bad_bytes, 0U);
    expect_as_produced(content);
  });
  if (!disk.unsupported.empty()) GTEST_SKIP() << "no disk of its own: " << disk.unsupported;
  EXPECT_TRUE(disk.passed) << "in the child process, see above";
}

TEST(LogOnAFullDisk, IsRefusedWhenItIsFullFromTheStart) {
  const TemporaryFolder folder;
  const SmallDiskOutcome disk = on_small_disk(folder.path(), kDisk, [&] {
    std::filesystem::create_directory(folder.path() / "log");
    ASSERT_TRUE(Ballast(folder.path() / "ballast").fill());
    EXPECT_FALSE(disk_has_room(folder.path(), 1));
    try {
      const LogWriter log(folder.path() / "log", header());
      ADD_FAILURE() << "a log on a full disk";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("No space"), std::string::npos) << error.what();
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "log")) << "no half header stays";
  });
  if (!disk.unsupported.empty()) GTEST_SKIP() << "no disk of its own: " << disk.unsupported;
  EXPECT_TRUE(disk.passed) << "in the child process, see above";
}

// The test of these tests: a failed assertion in the child is a failed test here.
TEST(LogOnAFullDisk, AFailureInTheChildIsSeen) {
  const TemporaryFolder folder;
  const SmallDiskOutcome thrown =
      on_small_disk(folder.path(), kDisk, [] { throw Error("planted"); });
  EXPECT_FALSE(thrown.passed);
  const SmallDiskOutcome ended = on_small_disk(folder.path(), kDisk, [] { std::raise(SIGKILL); });
  EXPECT_FALSE(ended.passed);
  const SmallDiskOutcome roomy = on_small_disk(
      folder.path(), kDisk, [&] { std::ofstream(folder.path() / "file") << "there is room"; });
  EXPECT_TRUE(roomy.passed || !roomy.unsupported.empty());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "the disk was the child's own";
}

}  // namespace
}  // namespace photocoag::testing
