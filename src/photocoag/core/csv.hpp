// Role: setup; tables of comma-separated values, row by row (RFC 4180, one line a row): cells may
// be in quotes. Used by run, report, run_files.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

class CsvReader {
 public:
  /// Takes the whole text; `where` names it in messages. A byte order mark is skipped. Throws Error
  /// for a second one and for a zero byte.
  CsvReader(std::string text, std::string where);
  CsvReader(const CsvReader&) = delete;
  CsvReader& operator=(const CsvReader&) = delete;

  /// Goes to the next line; false at the end. Throws Error for a quote that does not end.
  bool next();
  /// The cells of the current line, at least one, without their quotes; until the next next().
  const std::vector<std::string_view>& cells() const noexcept { return cells_; }
  /// True if there is nothing in the current line.
  bool blank() const noexcept { return cells_.size() == 1 && cells_.front().empty(); }
  std::size_t line() const noexcept { return line_; }
  /// "file:line" of the current line.
  std::string place() const;

 private:
  std::string where_;
  std::string text_;
  std::size_t at_ = 0;  // of the next line
  std::size_t line_ = 0;
  std::vector<std::string_view> cells_;
};

}  // namespace photocoag
