// Role: offline; a run as a table of named columns, and its ways into other programs: CSV, HDF5,
// MAT, MCAP. Used by `convert`. Source: docs/realtime.md. Units: one per column.
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

/// True temperatures that a log does not have, from the run.csv of the same run: the eye tells them
/// at the end of a treatment.
void add_truth(DataTable& log, const DataTable& run);

/// A number that does not exist is an empty cell in CSV, NaN elsewhere; a missing duration
/// INT64_MIN. Files are replaced as a whole. Throw Error.
std::string csv_text(const DataTable& table);
void write_hdf5(const std::string& file, const DataTable& table);
void write_mat(const std::string& file, const DataTable& table);
/// Log times are since the treatment's start. Throws Error also if there is no column time_s.
void write_mcap(const std::string& file, const DataTable& table);

}  // namespace photocoag
