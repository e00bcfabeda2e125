// Role: the program; run.csv as text and back, by the table of fields. Used by run, `convert`.
// Source: docs/run-folder.md. Units: in the names of the columns. Throws Error.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/log/fields.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// The same configuration, seed, build and machine give the same bytes.
/// `with_choroid`: with the estimate of beta.
std::string run_csv(const Treatment& treatment, bool with_choroid = false);

struct RunCsv {
  std::string file;
  std::vector<std::string> columns;
  std::vector<LogRecord> cycles;  ///< what has no column is as in LogRecord()

  bool has(std::string_view column) const noexcept;
  /// Throws Error naming the column if it is missing.
  void require(std::string_view column) const;
};

/// Columns of another program are left out; an empty file has no cycles. Throws Error naming file,
/// line and column.
RunCsv read_run_csv(const std::filesystem::path& file);

}  // namespace photocoag
