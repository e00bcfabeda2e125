// Role: the program; run.csv as text and back, by the table of fields. Used by run, python. Source:
// docs/run-folder.md. Units: in the names of the columns.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/log/fields.hpp"
#include "photocoag/run/treatment.hpp"

namespace photocoag {

/// The same configuration, seed, build and machine give the same bytes.
/// `with_choroid`: adds the estimate of beta.
std::string run_csv(const Treatment& treatment, bool with_choroid = false);

struct RunCsv {
  std::string file;
  std::vector<std::string> columns;
  std::vector<LogRecord> cycles;  ///< fields without a column are as in LogRecord()

  bool has(std::string_view column) const noexcept;
  /// Throws Error naming the column if it is missing.
  void require(std::string_view column) const;
};

/// Unknown columns are ignored; an empty file has no cycles. Throws Error naming file, line and
/// column.
RunCsv read_run_csv(const std::filesystem::path& file);

}  // namespace photocoag
