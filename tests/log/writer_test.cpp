// The log never makes the loop wait, and what it lost it has counted.
#include <gtest/gtest.h>

#include <unistd.h>
#include <cerrno>
#include <thread>

#include "log/segments.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/rt/clock.hpp"
#include "support/heap_guard.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

LogContent content_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  return read_segments(files);
}

void produce(LogWriter& log, std::int64_t records) {
  for (std::int64_t k = 0; k < records; ++k) {
    LogRecord record = record_of(k);
    log.record(record);
  }
}

TEST(Ring, KeepsOrderAndRefusesWhenFull) {
  SpscRing<int> ring(5);
  EXPECT_EQ(ring.capacity(), 8u);
  int next = 0;
  int expected = 0;
  std::array<int, 3> out{};
  for (int round = 0; round < 50; ++round) {
    while (ring.push(next)) ++next;
    EXPECT_EQ(next - expected, 8);
    const std::size_t count = ring.pop(out);
    for (std::size_t k = 0; k < count; ++k) EXPECT_EQ(out[k], expected++);
  }
}

TEST(Ring, BetweenTwoThreadsNothingIsLostOrTorn) {
  struct Pair {
    std::uint64_t a, b;
  };
  SpscRing<Pair> ring(64);
  constexpr std::uint64_t kCount = 200000;
  std::thread producer([&] {
    for (std::uint64_t k = 0; k < kCount;) k += ring.push({k, ~k}) ? 1 : 0;
  });
  std::array<Pair, 16> out{};
  std::uint64_t expected = 0;
  bool good = true;
  while (expected < kCount) {
    const std::size_t count = ring.pop(out);
    for (std::size_t k = 0; k < count; ++k) {
      good = good && out[k].a == expected && out[k].b == ~expected;
      ++expected;
    }
  }
  producer.join();
  EXPECT_TRUE(good);
}

TEST(LogWriter, WritesEverythingAndSaysThatItIsComplete) {
  const TemporaryFolder folder;
  LogWriter log(folder.path() / "log", header(), {.ring_records = 4096, .write = {}});
  produce(log, 1000);
  const LogTotals totals = log.close();
  EXPECT_EQ(totals, (LogTotals{.produced = 1000, .written = 1000, .dropped = 0}));
  EXPECT_TRUE(log.healthy());
  const LogContent content = content_of(folder.path() / "log");
  EXPECT_EQ(content.records.size(), 1000u);
  EXPECT_TRUE(content.closed);
  EXPECT_EQ(content.totals, totals);
  EXPECT_EQ(content.bad_bytes, 0u);
}

TEST(LogWriter, StartsNewSegments) {
  const TemporaryFolder folder;
  LogWriter log(folder.path() / "log", header(),
                {.ring_records = 4096, .segment_bytes = 300 * log_record_bytes(), .write = {}});
  produce(log, 1000);
  log.close();
  EXPECT_GE(log.segments(), 3);
  EXPECT_EQ(content_of(folder.path() / "log").records.size(), 1000u);
}

TEST(LogWriter, RecordingTakesNothingFromTheHeap) {
  const TemporaryFolder folder;
  LogWriter log(folder.path() / "log", header(), {.ring_records = 64, .write = {}});
  LogRecord record = record_of(1);
  const HeapGuard guard;
  for (int k = 0; k < 1000; ++k) log.record(record);  // also when the ring is full
  const HeapUse use = guard.use();
  EXPECT_EQ(use, HeapUse{});
  log.close();
}

TEST(LogWriter, IsRefusedWhereNothingCanBeWritten) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "file") << "x";
  EXPECT_THROW(LogWriter(folder.path() / "file" / "log", header()), Error);
  LogWriter first(folder.path() / "log", header());
  EXPECT_THROW(LogWriter(folder.path() / "log", header()), Error) << "never over another log";
  EXPECT_TRUE(disk_has_room(folder.path(), 1));
  EXPECT_FALSE(disk_has_room(folder.path(), std::uint64_t{1} << 60));
  EXPECT_FALSE(disk_has_room(folder.path() / "absent", 1));
}

TEST(LogWriter, AFullDiskIsCountedExactlyAndForgiven) {
  // Full from the third block on, half a block goes in; later there is room again.
  const TemporaryFolder folder;
  int calls = 0;
  LogWriter log(folder.path() / "log", header(),
                {.ring_records = 4096,
                 .write = [&](int file, const void* bytes, std::size_t count) -> ssize_t {
                   ++calls;
                   if (calls == 4) return ::write(file, bytes, count / 2);
                   if (calls > 4 && calls < 7) {
                     errno = ENOSPC;
                     return -1;
                   }
                   return ::write(file, bytes, count);
                 }});
  produce(log, 3000);
  const LogTotals totals = log.close();
  EXPECT_FALSE(log.healthy());
  EXPECT_NE(log.trouble().find("No space"), std::string::npos) << log.trouble();
  EXPECT_EQ(totals.produced, 3000u);
  EXPECT_GT(totals.dropped, 0u);
  EXPECT_EQ(totals.produced, totals.written + totals.dropped);
  const LogContent content = content_of(folder.path() / "log");
  EXPECT_EQ(content.records.size(), totals.written);
  EXPECT_EQ(content.bad_bytes, 0u) << "no half block stays";
  EXPECT_EQ(content.totals, totals);
}

TEST(LogWriter, AStallFillsTheRingAndIsCountedExactly) {
  const TemporaryFolder folder;
  std::atomic<bool> stalled{true};
  LogWriter log(
      folder.path() / "log", header(),
      {.ring_records = 64, .write = [&](int file, const void* bytes, std::size_t count) -> ssize_t {
         // The header goes through: the constructor waits for it.
         static thread_local bool in_thread = false;
         while (in_thread && stalled) wait_until(monotonic_ns() + 1'000'000);
         in_thread = true;
         return ::write(file, bytes, count);
       }});
  produce(log, 10);
  wait_until(monotonic_ns() + 50'000'000);
  produce(log, 5000);
  stalled = false;
  const LogTotals totals = log.close();
  EXPECT_EQ(totals.produced, 5010u);
  EXPECT_EQ(totals.produced, totals.written + totals.dropped);
  EXPECT_GT(totals.dropped, 4000u);
  const LogContent content = content_of(folder.path() / "log");
  EXPECT_EQ(content.records.size(), totals.written);
  EXPECT_EQ(content.totals, totals);
}

}  // namespace
}  // namespace photocoag::testing
