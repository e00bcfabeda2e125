#include "photocoag/log/segment.hpp"

#include <zlib.h>

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "photocoag/core/build_info.hpp"

namespace photocoag {

static_assert(std::endian::native == std::endian::little, "segments are written little-endian");

std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t start) noexcept {
  return static_cast<std::uint32_t>(
      ::crc32_z(start, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

void pack(const LogRecord& record, std::byte* to) noexcept {
  for (const CycleField& field : cycle_fields()) {
    const std::uint64_t bits = field.get(record);
    std::memcpy(to, &bits, 8);
    to += 8;
  }
}

std::string segment_header(const LogHeader& header) {
  // An array from the start: one that begins as null cannot be destroyed if memory ends there.
  nlohmann::ordered_json fields = nlohmann::ordered_json::array();
  for (const CycleField& field : cycle_fields()) {
    fields.push_back(
        {{"name", field.name}, {"unit", field.unit}, {"type", type_in_log(field.type)}});
  }
  nlohmann::ordered_json text = {{"notice", kResearchNotice},
                                 {"schema", header.schema},
                                 {"program", header.program},
                                 {"config_sha256", header.config_sha256},
                                 {"model_sha256", header.model_sha256},
                                 {"device", header.device},
                                 {"period_s", header.period},
                                 {"planned_cycles", header.planned_cycles},
                                 {"full_order_states", header.full_order_states},
                                 {"segment", header.segment},
                                 {"record_bytes", log_record_bytes()},
                                 {"fields", std::move(fields)}};
  // Names of devices need not be UTF-8.
  std::string json = text.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  json.resize((json.size() + 7) / 8 * 8, ' ');
  std::string bytes(kSegmentMagic);
  const auto append = [&bytes](std::uint32_t number) {
    char raw[4];
    std::memcpy(raw, &number, 4);
    bytes.append(raw, 4);
  };
  append(kLogFormat);
  append(static_cast<std::uint32_t>(json.size()));
  bytes += json;
  append(crc32(std::as_bytes(std::span(bytes))));
  append(0);  // blocks start at a multiple of 8
  return bytes;
}

namespace {

std::uint32_t checksum(std::span<const std::byte> block) noexcept {
  constexpr std::size_t kAt = offsetof(BlockHeader, crc);
  constexpr std::byte kZero[4]{};
  std::uint32_t crc = crc32(block.first(kAt));
  crc = crc32(kZero, crc);
  return crc32(block.subspan(kAt + 4), crc);
}

}  // namespace

void seal_block(std::span<std::byte> block) noexcept {
  const std::uint32_t crc = checksum(block);
  std::memcpy(block.data() + offsetof(BlockHeader, crc), &crc, 4);
}

bool block_is_good(std::span<const std::byte> block) noexcept {
  std::uint32_t stored = 0;
  std::memcpy(&stored, block.data() + offsetof(BlockHeader, crc), 4);
  return stored == checksum(block);
}

}  // namespace photocoag
