// Role: offline; reads log segments, even damaged ones: all complete blocks are recovered. Used by
// run, run_files, fault_table. Source: docs/realtime.md (format).
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
  bool closed = false;               ///< the program closed the log
  LogTotals totals;                  ///< of the last good block
  std::size_t bad_bytes = 0;         ///< bytes that belong to no complete block
  std::vector<std::string> remarks;  ///< findings for the user
};

/// One segment from memory; errors name it `where`. Throws Error if its header is incomplete, of
/// another format, or lacks a field that every record needs; never for damage behind the header.
LogContent parse_segment(std::string_view bytes, const std::string& where);

/// Several segments of one run, in any order; duplicate records count once. A segment with a broken
/// header is skipped with a remark. Throws Error if none is left or they belong to different runs.
LogContent read_segments(const std::vector<std::filesystem::path>& files);

/// The segments of RUN/log in the order of their names; empty if there are none.
std::vector<std::filesystem::path> segments_of(const std::filesystem::path& run_folder);

}  // namespace photocoag
