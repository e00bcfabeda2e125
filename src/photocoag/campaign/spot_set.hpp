// Role: offline; which spots of a campaign are done, as intervals of their numbers: spots are
// handed out in order, so a few intervals represent any number of them. Used by campaign/journal,
// run_campaign and results_file. Real-time promise: none.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

namespace photocoag {

class SpotSet {
 public:
  struct Interval {
    std::uint64_t first = 0;
    std::uint64_t end = 0;  ///< one past the last
  };

  /// False: it was there already.
  bool insert(std::uint64_t spot);
  bool contains(std::uint64_t spot) const;
  std::uint64_t size() const noexcept { return size_; }
  /// The first missing number from `from` on.
  std::uint64_t next_missing(std::uint64_t from) const;
  std::vector<Interval> intervals() const;

 private:
  std::map<std::uint64_t, std::uint64_t> ends_;  // of the intervals, by their first numbers
  std::uint64_t size_ = 0;
};

/// Rows of the spots of a set as it is now, in the order of their numbers.
class RowOfSpot {
 public:
  explicit RowOfSpot(const SpotSet& spots);
  /// Precondition: the spot is in the set.
  std::uint64_t operator()(std::uint64_t spot) const;

 private:
  std::vector<SpotSet::Interval> intervals_;
  std::vector<std::uint64_t> rows_;  // of the intervals' first numbers
};

}  // namespace photocoag
