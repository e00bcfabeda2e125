// Role: offline; sorts more pairs of numbers than memory holds: external merge sort with sorted
// runs in an unnamed file. Used by campaign/table_statistics. Source: Knuth, The Art of Computer
// Programming 3, section 5.4. Memory: some 10 MB. Real-time promise: none.
#pragma once

#include <compare>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "photocoag/core/descriptor.hpp"

namespace photocoag {

struct KeyedValue {
  std::uint64_t key = 0;
  std::uint64_t value = 0;
  friend auto operator<=>(const KeyedValue&, const KeyedValue&) = default;
};

class PairSorter {
 public:
  static constexpr std::size_t kInMemory = std::size_t{1} << 18U;  // pairs

  /// `folder`: for the file, which is created only for more than `in_memory` pairs and vanishes
  /// with the process.
  explicit PairSorter(std::filesystem::path folder, std::size_t in_memory = kInMemory);

  /// Throws Error if the file cannot be written.
  void add(KeyedValue pair);
  /// After the last add.
  void finish();

  /// Iterates over all pairs in ascending order; several cursors may be used at once. The sorter
  /// must outlive it.
  class Cursor {
   public:
    explicit Cursor(const PairSorter& sorter);
    /// False: no more. Throws Error if the file cannot be read.
    bool next(KeyedValue& pair);

   private:
    struct Run {
      std::uint64_t at = 0;   // pairs of the file that have been read
      std::uint64_t end = 0;  // of the run
      std::vector<KeyedValue> buffer;
      std::size_t next = 0;
    };
    bool fill(Run& run) const;

    const PairSorter& sorter_;
    std::size_t at_ = 0;  // in memory
    std::size_t buffer_ = 0;
    std::vector<Run> runs_;
    std::vector<std::size_t> heap_;  // runs, the one with the least pair first
  };

 private:
  void write_run();

  std::filesystem::path folder_;
  std::size_t in_memory_;
  std::vector<KeyedValue> pairs_;
  Descriptor file_;
  std::vector<std::uint64_t> ends_;  // of the runs in the file, in pairs
};

}  // namespace photocoag
