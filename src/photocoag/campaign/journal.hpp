// Role: offline; finished spots on disk, so that an interrupted campaign continues. Used by
// campaign. Append-only: a header, then one block of fixed size per spot with its checksum;
// truncated or damaged blocks and second blocks of a spot are ignored. Memory does not depend on
// the number of spots. Real-time promise: none. Threads: one owner; an internal thread calls fsync.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <string>

#include "photocoag/campaign/spot.hpp"
#include "photocoag/campaign/spot_set.hpp"
#include "photocoag/core/descriptor.hpp"

namespace photocoag {

class Journal {
 public:
  /// Opens or creates `file`, locks it and finds the spots that are done. Throws Error if another
  /// process has it, or if it belongs to another campaign (file, configuration or program have
  /// changed).
  Journal(const std::filesystem::path& file, const Campaign& campaign);
  ~Journal();

  const SpotSet& spots() const noexcept { return spots_; }
  /// Returns when the operating system has the block: a crash of the program then loses nothing. It
  /// reaches the disk within a second or two, the last block of a campaign at once: a power cut
  /// loses what was computed since. Throws Error, also for earlier blocks.
  void append(const SpotRecord& record);
  /// Calls `see` with the block (campaign/spot.hpp) of each spot once, in the order of the file.
  void for_each(const std::function<void(const double* block)>& see) const;

  /// Bytes of a spot.
  static std::size_t bytes_per_spot(const Campaign& campaign);

 private:
  void open_for(const Campaign& campaign);
  [[noreturn]] void fail(const char* what) const;
  // Up to `bytes` bytes from `offset` on; fewer at the end of the file.
  std::size_t read_at(void* data, std::size_t bytes, std::uint64_t offset) const;
  // Starts an fsync without waiting; reports the result of the previous one.
  void begin_sync();
  void end_sync();
  bool sync_is_due() const;
  // Every block whose checksum is right; the end of the last whole one in the file.
  std::uint64_t for_each_good(const std::function<void(const double* block)>& see) const;

  std::string name_;
  std::uint64_t campaign_spots_;
  std::size_t block_size_;  // with the checksum
  Descriptor file_;
  std::uint64_t header_ = 0;  // bytes
  SpotSet spots_;
  std::chrono::steady_clock::time_point synced_;  // start of the last fsync
  std::future<int> syncing_;                      // its errno
};

}  // namespace photocoag
