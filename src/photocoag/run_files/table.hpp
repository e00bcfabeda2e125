// Role: offline; a run as a table of named columns, and its export to CSV, HDF5, MAT and MCAP. Used
// by `convert`, session. Source: docs/realtime.md. Units: one per column.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "photocoag/log/reader.hpp"

namespace photocoag {

struct TableColumn {
  std::string name;
  std::string unit;
  std::variant<std::vector<double>, std::vector<std::int64_t>, std::vector<std::string>> values;
  std::size_t size() const {
    return std::visit([](const auto& list) { return list.size(); }, values);
  }
};

struct DataTable {
  std::vector<std::pair<std::string, std::string>> about;  ///< name, text
  std::vector<TableColumn> columns;                        ///< all of one length
  std::string rows_are = "cycles";                         ///< name of the HDF5 group
  std::size_t rows() const { return columns.empty() ? 0 : columns.front().size(); }
};

/// Every field of the log, one row per cycle; enumerations as their words.
DataTable table_of(const LogContent& log);

/// run.csv of a run folder that has no log. Throws Error.
DataTable table_of_csv(const std::filesystem::path& file);

/// Adds the true temperatures from the run.csv of the same run: an eye in another process reports
/// them only at the end of a treatment, so that the log does not have them.
void add_truth(DataTable& log, const DataTable& run);

/// Missing numbers are empty cells in CSV and NaN elsewhere; missing durations are INT64_MIN. Files
/// are replaced atomically. Each throws Error.
std::string csv_text(const DataTable& table);
void write_hdf5(const std::string& file, const DataTable& table);
void write_mat(const std::string& file, const DataTable& table);
/// Log times count from the treatment's start. Also throws Error if there is no column time_s.
void write_mcap(const std::string& file, const DataTable& table);

}  // namespace photocoag
