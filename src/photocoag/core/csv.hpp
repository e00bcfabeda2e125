// Role: setup; reads comma-separated values row by row (RFC 4180, but one row per line). Used by
// run, report, run_files.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

class CsvReader {
 public:
  /// Takes the whole text; errors name it `where`. A byte order mark is skipped. Throws Error on a
  /// second one and on a zero byte.
  CsvReader(std::string text, std::string where);
  CsvReader(const CsvReader&) = delete;
  CsvReader& operator=(const CsvReader&) = delete;

  /// Goes to the next line; false at the end. Throws Error on an unclosed quote.
  bool next();
  /// The cells of the current line, at least one, without their quotes; valid until next().
  const std::vector<std::string_view>& cells() const noexcept { return cells_; }
  /// True if the current line is empty.
  bool blank() const noexcept { return cells_.size() == 1 && cells_.front().empty(); }
  std::size_t line() const noexcept { return line_; }
  /// "file:line" of the current line.
  std::string place() const;

 private:
  std::string where_;
  std::string text_;
  std::size_t at_ = 0;  // start of the next line
  std::size_t line_ = 0;
  std::vector<std::string_view> cells_;
};

}  // namespace photocoag
