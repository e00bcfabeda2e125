// Role: setup; the bytes of a log file ("segment"): header, blocks of records, checksums. Used by
// writer and reader. Source: docs/realtime.md (format). Little-endian, as the machines it runs on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/log/fields.hpp"

namespace photocoag {

inline constexpr int kLogFormat = 1;                   ///< of the bytes below
inline constexpr std::size_t kBlockRecords = 256;      ///< at most, in one block
inline constexpr std::size_t kMostHeaderText = 65536;  ///< bytes

/// A segment's header.
struct LogHeader {
  int schema = kLogSchema;
  std::string program;  ///< version and source hash
  std::string config_sha256;
  std::string model_sha256;
  std::string device;   ///< device of the treatment; empty: the simulated eye of this process
  double period = 0.0;  ///< s
  std::int64_t planned_cycles = 0;
  std::int64_t full_order_states = 0;
  std::int64_t segment = 0;  ///< 0, 1, …
  /// Name, unit, and "f8" or "i8" of each field; filled by the reader.
  struct Field {
    std::string name, unit, type;
  };
  std::vector<Field> fields;
};

/// produced = written + dropped, always; `dropped` counts a full ring and records that could not be
/// written.
struct LogTotals {
  std::uint64_t produced = 0;
  std::uint64_t written = 0;
  std::uint64_t dropped = 0;
  bool operator==(const LogTotals&) const = default;
};

/// In front of every block.
struct BlockHeader {
  static constexpr std::uint32_t kMagic = 0x4b4c4250;  // "PBLK"
  static constexpr std::uint32_t kLast = 1;            ///< flag: the log was closed
  std::uint32_t magic = kMagic;
  std::uint32_t flags = 0;
  std::uint32_t records = 0;
  std::uint32_t crc = 0;  ///< CRC-32 of header (with 0 here) and records
  LogTotals totals;       ///< when the block was written, this block included
};
static_assert(sizeof(BlockHeader) == 40);

inline constexpr std::string_view kSegmentMagic = "PCAGLOG\n";

/// CRC-32 (the one of zlib, PNG, Ethernet), continued from `start`.
std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t start = 0) noexcept;

/// A record as stored in a block: eight bytes per field. `to` has log_record_bytes().
void pack(const LogRecord& record, std::byte* to) noexcept;

/// The bytes in front of the first block.
std::string segment_header(const LogHeader& header);

/// Fills in the checksum of a block in memory: header, then records.
void seal_block(std::span<std::byte> block) noexcept;
/// True if the checksum of a complete block is right.
bool block_is_good(std::span<const std::byte> block) noexcept;

}  // namespace photocoag
