// Role: tests of log; records, segments and what can happen to them.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "photocoag/log/reader.hpp"
#include "photocoag/log/writer.hpp"

namespace photocoag::testing {

inline LogRecord record_of(std::int64_t cycle) {
  LogRecord record;
  record.cycle = cycle;
  record.time = 1e-3 * static_cast<double>(cycle + 1);
  record.power = 0.1 / static_cast<double>(cycle + 1);
  record.measured = cycle % 7 == 0 ? LogRecord::kNone : 0.1 * static_cast<double>(cycle);
  return record;
}

/// Its bytes in a block.
inline std::string packed(const LogRecord& record) {
  std::string bytes(log_record_bytes(), '\0');
  pack(record, reinterpret_cast<std::byte*>(bytes.data()));
  return bytes;
}

inline LogHeader header() {
  return {.program = "photocoag test",
          .config_sha256 = "c0ffee",
          .model_sha256 = "beef",
          .device = {},
          .period = 1e-3,
          .planned_cycles = 1000,
          .fields = {}};
}

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A block as the writer makes it.
inline std::string block_of(std::int64_t first, std::uint32_t records) {
  BlockHeader head;
  head.records = records;
  head.totals.produced = head.totals.written = static_cast<std::uint64_t>(first) + records;
  std::string bytes(reinterpret_cast<const char*>(&head), sizeof(head));
  for (std::uint32_t k = 0; k < records; ++k) {
    LogRecord record = record_of(first + k);
    record.record = first + k;
    bytes += packed(record);
  }
  seal_block(std::as_writable_bytes(std::span(bytes)));
  return bytes;
}

/// Header and `blocks` blocks of 5 records each.
inline std::string segment_of(int blocks) {
  std::string bytes = segment_header(header());
  for (int k = 0; k < blocks; ++k) bytes += block_of(5 * k, 5);
  return bytes;
}

}  // namespace photocoag::testing
