// Role: offline; reads segments, whatever has happened to them: all complete blocks come out.
// Used by `convert`, tests, fuzzers. Source: docs/realtime.md (format). Throws Error.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/log/segment.hpp"

namespace photocoag {

struct LogContent {
  LogHeader header;                  ///< of the first segment
  std::vector<LogRecord> records;    ///< in the order of their numbers
  bool closed = false;               ///< the program has ended the log itself
  LogTotals totals;                  ///< of the last good block
  std::size_t bad_bytes = 0;         ///< in no complete block
  std::vector<std::string> remarks;  ///< what was found besides, in words
};

/// One segment from memory; `where` names it in messages. Throws Error if its header is not whole,
/// of another format, or without the fields that every record needs; never for what follows.
LogContent parse_segment(std::string_view bytes, const std::string& where);

/// Several segments of one run, in any order; records with a number that was there already count
/// once. A segment whose header is broken is left out with a remark; if none is left: Error.
/// Throws Error as well if they belong to different runs.
LogContent read_segments(const std::vector<std::filesystem::path>& files);

/// The segments of RUN/log in the order of their names; empty if there are none.
std::vector<std::filesystem::path> segments_of(const std::filesystem::path& run_folder);

}  // namespace photocoag
