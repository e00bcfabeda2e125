// Role: offline; finished spots on disk, so that an interrupted campaign continues. Used by
// campaign. Append-only: a header, then one block of fixed size per spot with its checksum; a block
// cut short by a crash is dropped, and so is the second block of a spot. Real-time promise: none.
// Threads: one owner.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/campaign/spot.hpp"

namespace photocoag {

/// A spot as bytes, for the journal and for messages between ranks.
std::vector<double> to_block(const SpotRecord& record);
SpotRecord from_block(const double* block, std::size_t inputs);
std::size_t block_size(std::size_t inputs);

class Journal {
 public:
  /// Opens or makes `file`, locks it, and reads the spots that are there, each once. Throws Error
  /// if another process has it, or if it belongs to another campaign (file, configuration or
  /// program have changed).
  Journal(const std::filesystem::path& file, const Campaign& campaign);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  const std::vector<SpotRecord>& found() const noexcept { return found_; }
  /// Returns when the system has the block: a crash of the program loses nothing after that.
  void append(const SpotRecord& record);

 private:
  void read(const Campaign& campaign);

  std::string name_;
  int file_ = -1;
  std::vector<SpotRecord> found_;
};

}  // namespace photocoag
