// Role: offline; the rows of a campaign's table in the order of their spots, read in chunks,
// repeatedly: the statistics' view of a campaign of any size. Used by campaign. A row is a block of
// campaign/spot.hpp. Real-time promise: none.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "photocoag/campaign/spot.hpp"

namespace photocoag {

struct SpotRows {
  std::uint64_t count = 0;
  std::size_t inputs = 0;  ///< columns of inputs
  /// Reads `rows` consecutive blocks from row `first` on into `blocks`. May throw Error.
  std::function<void(std::uint64_t first, std::size_t rows, double* blocks)> read;

  /// Calls `see` with each row, by number.
  void for_each(const std::function<void(const double* block)>& see) const;
};

/// Rows that are all in memory; `spots` must outlive them.
SpotRows rows_of(const std::vector<SpotRecord>& spots);

}  // namespace photocoag
