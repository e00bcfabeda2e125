#include "photocoag/campaign/spot_set.hpp"

#include <algorithm>
#include <iterator>

namespace photocoag {

bool SpotSet::insert(std::uint64_t spot) {
  const auto after = ends_.upper_bound(spot);
  const auto before = after == ends_.begin() ? ends_.end() : std::prev(after);
  if (before != ends_.end() && spot < before->second) return false;
  ++size_;
  const bool meets_after = after != ends_.end() && after->first == spot + 1;
  if (before != ends_.end() && before->second == spot) {
    before->second = meets_after ? after->second : spot + 1;
    if (meets_after) ends_.erase(after);
    return true;
  }
  const std::uint64_t end = meets_after ? after->second : spot + 1;
  if (meets_after) ends_.erase(after);
  ends_.emplace(spot, end);
  return true;
}

bool SpotSet::contains(std::uint64_t spot) const { return next_missing(spot) != spot; }

std::uint64_t SpotSet::next_missing(std::uint64_t from) const {
  const auto after = ends_.upper_bound(from);
  if (after == ends_.begin()) return from;
  return std::max(from, std::prev(after)->second);
}

std::vector<SpotSet::Interval> SpotSet::intervals() const {
  std::vector<Interval> all;
  for (const auto& [first, end] : ends_) all.push_back({first, end});
  return all;
}

RowOfSpot::RowOfSpot(const SpotSet& spots) : intervals_(spots.intervals()) {
  std::uint64_t row = 0;
  for (const SpotSet::Interval& interval : intervals_) {
    rows_.push_back(row);
    row += interval.end - interval.first;
  }
}

std::uint64_t RowOfSpot::operator()(std::uint64_t spot) const {
  const auto after = std::upper_bound(
      intervals_.begin(), intervals_.end(), spot,
      [](std::uint64_t value, const SpotSet::Interval& i) { return value < i.first; });
  const auto at = static_cast<std::size_t>(after - intervals_.begin()) - 1;
  return rows_[at] + (spot - intervals_[at].first);
}

}  // namespace photocoag
