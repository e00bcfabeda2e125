// Role: offline; the table of a cycle's fields behind log, run.csv, HDF5, MAT, MCAP, replay and
// recovery: a new column is one row here. Used by log, run, run_files, console, python. Real time:
// none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "photocoag/log/record.hpp"

namespace photocoag {

enum class FieldType : std::uint8_t {
  kReal,
  kInteger,  ///< flags are 0 and 1
  kWord,     ///< an enumeration: its number in the log, its word in tables
};

/// Whether a field is a column of run.csv.
enum class InCsv : std::uint8_t {
  kNo,
  kYes,
  kMayBeEmpty,   ///< empty where the value is not finite
  kWithChoroid,  ///< if beta is estimated
  kWithDevice,   ///< unless the eye is simulated in this process; may be empty
};

/// Eight bytes of a log record: a double's bits, or a signed integer.
struct CycleField {
  std::string_view name;  ///< of the column, with the unit
  std::string_view unit;
  FieldType type;
  InCsv in_csv;
  std::uint64_t (*get)(const LogRecord& record) noexcept;
  /// Out-of-range codes map to the first enumerator.
  void (*set)(LogRecord& record, std::uint64_t bits) noexcept;
  std::string_view (*word)(std::uint64_t bits) noexcept;  ///< null unless kWord
  std::string_view formerly;                              ///< name in logs older than schema 4
};

/// Version of the table. Readers look fields up by name, so new fields break nothing. Before
/// version 3, unknown true temperatures were 0 instead of NaN.
inline constexpr int kLogSchema = 4;

/// In the order of run.csv; fields of the log alone come last, except the record's number.
std::span<const CycleField> cycle_fields() noexcept;

/// Null if there is none.
const CycleField* field_named(std::string_view name) noexcept;

/// "f8" or "i8", as in the log's header.
constexpr std::string_view type_in_log(FieldType type) noexcept {
  return type == FieldType::kReal ? "f8" : "i8";
}

/// Bytes of a record in the log.
std::size_t log_record_bytes() noexcept;

/// The field as run.csv writes it: the shortest text that reads back to the same number.
std::string cell_of(const CycleField& field, const LogRecord& record);

/// Reads a cell into the record; an empty one is NaN, or 0. False: neither a number nor a word.
bool set_cell(const CycleField& field, std::string_view cell, LogRecord& record);

}  // namespace photocoag
