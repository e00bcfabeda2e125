#include "photocoag/run/run_csv.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "photocoag/core/csv.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kLargestRun = std::size_t{1} << 30;  // bytes

std::vector<const CycleField*> columns_of(const Treatment& treatment, bool with_choroid) {
  std::vector<const CycleField*> columns;
  for (const CycleField& field : cycle_fields()) {
    // A device may emit another power than commanded; the simulated eye of this process does not.
    const bool there = field.in_csv == InCsv::kYes || field.in_csv == InCsv::kMayBeEmpty ||
                       (field.in_csv == InCsv::kWithChoroid && with_choroid) ||
                       (field.in_csv == InCsv::kWithDevice && treatment.device);
    if (there) columns.push_back(&field);
  }
  return columns;
}

}  // namespace

std::string run_csv(const Treatment& treatment, bool with_choroid) {
  const std::vector<const CycleField*> columns = columns_of(treatment, with_choroid);
  std::string text;
  const auto end_cell = [&](const CycleField* column) {
    text += column == columns.back() ? '\n' : ',';
  };
  for (const CycleField* column : columns) {
    text += column->name;
    end_cell(column);
  }
  for (const CycleRecord& cycle : treatment.records) {
    const LogRecord record(cycle, CycleEnd{});
    for (const CycleField* column : columns) {
      text += cell_of(*column, record);
      end_cell(column);
    }
  }
  return text;
}

bool RunCsv::has(std::string_view column) const noexcept {
  return std::find(columns.begin(), columns.end(), column) != columns.end();
}

void RunCsv::require(std::string_view column) const {
  if (has(column)) return;
  throw Error(ErrorParts{.where = file + ":1",
                         .key = std::string(column),
                         .found = "no such column",
                         .accepted = "a run.csv of this version"});
}

RunCsv read_run_csv(const std::filesystem::path& file) {
  RunCsv run{.file = file.string(), .columns = {}, .cycles = {}};
  CsvReader rows(read_file(run.file, kLargestRun, "run.csv"), run.file);
  rows.next();
  run.columns.assign(rows.cells().begin(), rows.cells().end());
  std::vector<const CycleField*> fields;
  for (const std::string& column : run.columns) fields.push_back(field_named(column));
  while (rows.next()) {
    const std::vector<std::string_view>& cells = rows.cells();
    if (cells.size() != fields.size()) {
      throw Error(ErrorParts{.where = rows.place(),
                             .found = fmt::format("{} cells", cells.size()),
                             .accepted = fmt::format("{} cells", fields.size())});
    }
    LogRecord record;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      if (fields[k] == nullptr || set_cell(*fields[k], cells[k], record)) continue;
      throw Error(
          ErrorParts{.where = rows.place(),
                     .key = run.columns[k],
                     .found = std::string(cells[k]),
                     .accepted = fields[k]->word == nullptr ? "a number" : "one of its words"});
    }
    run.cycles.push_back(record);
  }
  return run;
}

}  // namespace photocoag
