// The whole fault table of docs/safety.md in virtual time, as `faults` runs it: five absorptions,
// two horizons, 1 kHz and 250 Hz, with and without a delayed command. tests/fault_table has a part
// of it.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "photocoag/core/files.hpp"
#include "photocoag/fault_table/fault_trials.hpp"

namespace photocoag {
namespace {

using Cells = std::vector<std::string>;

// The table rows of the document, by the id in their first cell; the first of each id.
std::map<std::string, Cells> documented_rows() {
  std::map<std::string, Cells> rows;
  std::istringstream document(read_file(PHOTOCOAG_SOURCE_DIR "/docs/safety.md", 1 << 20));
  for (std::string line; std::getline(document, line);) {
    Cells cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, '|');) {
      const std::size_t first = cell.find_first_not_of(' ');
      cells.push_back(first == std::string::npos
                          ? ""
                          : cell.substr(first, cell.find_last_not_of(' ') + 1 - first));
    }
    if (cells.size() > 2) rows.emplace(cells[1], cells);
  }
  return rows;
}

std::string with_separator(int count) {
  const std::string digits = std::to_string(count);
  return digits.size() < 4
             ? digits
             : digits.substr(0, digits.size() - 3) + "," + digits.substr(digits.size() - 3);
}

TEST(WholeFaultTable, EveryRunPassesAndTheDocumentSaysSo) {
  const std::map<std::string, Cells> documented = documented_rows();
  for (const FaultRow& row : run_fault_table({.overrides = {}, .only = {}})) {
    EXPECT_EQ(row.passed, row.runs) << row.id << ": " << row.first_failure;
    EXPECT_EQ(row.false_stops, 0) << row.id;
    ASSERT_TRUE(documented.contains(row.id)) << row.id;
    const Cells& cells = documented.at(row.id);
    if (row.id[0] == 'O') {  // | row | fault | 10 kHz | 1 kHz | 250 Hz |
      std::size_t column = 3;
      for (const auto& [period, peak] : row.peak_at) {
        EXPECT_EQ(cells.at(column++), fmt::format("{:.2f}", peak)) << row.id << ' ' << period;
      }
      continue;
    }
    // | row | fault | demand | runs | slowest | highest true peak |
    EXPECT_EQ(cells.at(4), with_separator(row.runs)) << row.id;
    if (cells.at(5) != "-") {
      EXPECT_EQ(cells.at(5), std::to_string(row.slowest)) << row.id;
    }
    EXPECT_EQ(cells.at(6), fmt::format("{:.2f} K", row.peak)) << row.id;
    if (row.id == "M8") {
      const std::string sentence = fmt::format(
          "M8: {} of {} runs were noticed", with_separator(row.detected), with_separator(row.runs));
      EXPECT_NE(read_file(PHOTOCOAG_SOURCE_DIR "/docs/safety.md", 1 << 20).find(sentence),
                std::string::npos)
          << sentence;
    }
  }
}

}  // namespace
}  // namespace photocoag
