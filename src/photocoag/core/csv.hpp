// Role: setup; one line of a table of comma-separated values. Used by run, report, tables. Knows no
// quotes: none of the project's tables has a comma in a cell.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

namespace photocoag {

/// The cells of a line, at least one; views into it. A carriage return at its end is dropped.
inline std::vector<std::string_view> csv_cells(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  std::vector<std::string_view> cells;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t comma = std::min(line.find(',', at), line.size());
    cells.push_back(line.substr(at, comma - at));
    at = comma + 1;
  }
  return cells;
}

}  // namespace photocoag
