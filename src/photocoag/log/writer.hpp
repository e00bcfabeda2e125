// Role: online; writes the loop's records to disk without ever blocking the loop. The loop's thread
// puts records into a ring; a second thread writes them to append-only segments, a third calls
// fsync, which may take long. Used by run.
// Source: docs/realtime.md. Real time: record() is noexcept, wait-free, allocation-free; the rest
// blocks and may throw. Threads: record() from one thread; open and close from the owner's.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "photocoag/log/record.hpp"
#include "photocoag/log/ring.hpp"
#include "photocoag/log/segment.hpp"

namespace photocoag {

struct LogOptions {
  std::size_t ring_records = 0;  ///< records buffered while the disk stalls; 0: one second's
  std::size_t segment_bytes = std::size_t{64} << 20;  ///< bytes after which the next segment begins
  std::int64_t look_ns = 10'000'000;                  ///< ns, polling interval of the ring
  std::int64_t sync_ns = 100'000'000;                 ///< ns, interval of fsync
  /// Replaces write(2) in tests of full and slow disks.
  std::function<ssize_t(int file, const void* bytes, std::size_t count)> write;
};

/// One log: a folder of segments 000000.seg, 000001.seg, …
class LogWriter {
 public:
  /// Creates the folder and the first segment, starts the thread. Throws Error.
  LogWriter(std::filesystem::path folder, LogHeader header, LogOptions options = {});
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Called by the loop: queues the record, or drops and counts it. Sets its `record` number.
  void record(LogRecord& record) noexcept;

  /// Writes what is left, marks the log as complete, ends the threads. Call once.
  LogTotals close();

  /// False after any record was dropped or any write failed: no further treatment may start.
  bool healthy() const noexcept { return !failed_.load(std::memory_order_relaxed); }
  /// Description of the failure, empty while healthy. Valid after close().
  const std::string& trouble() const noexcept { return trouble_; }
  std::int64_t segments() const noexcept { return header_.segment + 1; }

 private:
  void run() noexcept;
  void run_sync() noexcept;
  std::size_t drain() noexcept;
  void write_block(std::size_t records, std::uint32_t flags) noexcept;
  bool write_all(const std::byte* bytes, std::size_t count) noexcept;
  bool reserve(std::size_t bytes) noexcept;
  bool open_segment(std::int64_t number) noexcept;

  std::filesystem::path folder_;
  LogHeader header_;
  LogOptions options_;
  SpscRing<LogRecord> ring_;
  std::vector<LogRecord> batch_;
  std::vector<std::byte> block_;
  int file_ = -1;
  std::atomic<int> to_sync_{-1};  // for the fsync thread
  std::atomic<int> retired_{-1};  // a full segment, to be closed by the fsync thread
  std::size_t segment_size_ = 0;  // bytes of complete blocks
  std::uint64_t written_ = 0;
  std::uint64_t lost_ = 0;  // taken from the ring, not written
  int error_ = 0;           // errno of the first failure
  std::string trouble_;
  std::atomic<std::uint64_t> produced_{0};
  std::atomic<std::uint64_t> overflow_{0};
  std::atomic<bool> failed_{false};
  std::atomic<bool> closing_{false};
  std::atomic<bool> all_written_{false};
  std::thread thread_;
  std::thread sync_thread_;
};

/// True if the folder's disk has room for so many bytes.
bool disk_has_room(const std::filesystem::path& folder, std::uint64_t bytes) noexcept;

}  // namespace photocoag
