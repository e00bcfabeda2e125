// Role: offline; the one table of a cycle's fields. Log, run.csv, HDF5 and MAT, replay and recovery
// go through it: a new column is a row here. Used by log, run, run_files. Real time: none.
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

/// A column of run.csv.
enum class InCsv : std::uint8_t {
  kNo,
  kYes,
  kMayBeEmpty,   ///< a cell of what is not finite is empty
  kWithChoroid,  ///< if beta is estimated
  kWithDevice,   ///< if the eye is not that of the same process; may be empty
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
  std::string_view formerly;                              ///< name in logs before schema 4
};

/// Version of the table. Readers go by name, so that a new field breaks nothing. Before 3 the true
/// temperatures of a device, which does not tell them, were 0 instead of NaN.
inline constexpr int kLogSchema = 4;

/// In the order of run.csv; what only the log has comes last, but for the record's number.
std::span<const CycleField> cycle_fields() noexcept;

/// Null if there is none.
const CycleField* field_named(std::string_view name) noexcept;

/// "f8" or "i8", as the log's header says it.
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
