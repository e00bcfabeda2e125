#include "photocoag/core/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag {

CsvReader::CsvReader(std::string text, std::string where)
    : where_(std::move(where)), text_(plain_text(std::move(text), where_)) {}

std::string CsvReader::place() const { return fmt::format("{}:{}", where_, line_); }

bool CsvReader::next() {
  cells_.clear();
  if (at_ >= text_.size()) return false;
  ++line_;
  const std::size_t newline = std::min(text_.find('\n', at_), text_.size());
  std::size_t end = newline;
  if (end > at_ && text_[end - 1] == '\r') --end;
  for (std::size_t at = at_; at <= end;) {
    if (at == end || text_[at] != '"') {
      const std::size_t comma = std::min(text_.find(',', at), end);
      cells_.emplace_back(text_.data() + at, comma - at);
      at = comma + 1;
      continue;
    }
    // Doubled quotes become one, in place.
    const std::size_t begin = ++at;
    std::size_t to = begin;
    for (; at < end && (text_[at] != '"' || (at + 1 < end && text_[at + 1] == '"')); ++at) {
      if (text_[at] == '"') ++at;
      text_[to++] = text_[at];
    }
    if (at >= end || (at + 1 < end && text_[at + 1] != ',')) {
      throw Error(ErrorParts{.where = place(),
                             .problem = "text after a closing quote, or no closing quote",
                             .accepted = "\"text\", with quotes in it doubled, in one line"});
    }
    cells_.emplace_back(text_.data() + begin, to - begin);
    at += 2;
  }
  at_ = newline + 1;
  return true;
}

}  // namespace photocoag
