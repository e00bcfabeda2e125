#include "photocoag/log/reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::json;
constexpr std::size_t kPrefix = 16;       // magic, format, length
constexpr std::size_t kMostFields = 512;  // of a record
constexpr std::size_t kLargestSegment = std::size_t{1} << 30;

[[noreturn]] void refuse(const std::string& where, std::string problem, std::string found = {},
                         std::string accepted = {}) {
  throw Error(ErrorParts{.where = where,
                         .problem = std::move(problem),
                         .found = std::move(found),
                         .accepted = std::move(accepted)});
}

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, bytes.data() + at, 4);
  return number;
}

std::string text_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::int64_t count_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number_integer() ? found->get<std::int64_t>() : -1;
}

/// Header and the offset of the first block.
std::pair<LogHeader, std::size_t> parse_header(std::string_view bytes, const std::string& where) {
  if (bytes.size() < kPrefix || bytes.substr(0, kSegmentMagic.size()) != kSegmentMagic) {
    refuse(where, "not a log segment", fmt::format("{} bytes", bytes.size()),
           "a file that begins with PCAGLOG");
  }
  const std::uint32_t format = number_at(bytes, 8);
  if (format != kLogFormat) {
    refuse(where, "another format", fmt::format("{}", format), fmt::format("{}", kLogFormat));
  }
  const std::size_t length = number_at(bytes, 12);
  if (length > kMostHeaderText || length % 8 != 0 || bytes.size() < kPrefix + length + 8) {
    refuse(where, "the header is not whole", fmt::format("{} bytes of text", length));
  }
  const std::string_view sealed = bytes.substr(0, kPrefix + length);
  if (number_at(bytes, kPrefix + length) != crc32(std::as_bytes(std::span(sealed)))) {
    refuse(where, "the header's checksum is wrong");
  }
  const Json json = Json::parse(sealed.substr(kPrefix), nullptr, false);
  if (!json.is_object()) refuse(where, "the header is no JSON object");
  LogHeader header;
  header.schema = static_cast<int>(std::clamp<std::int64_t>(count_of(json, "schema"), -1, 1 << 30));
  header.program = text_of(json, "program");
  header.config_sha256 = text_of(json, "config_sha256");
  header.model_sha256 = text_of(json, "model_sha256");
  header.device = text_of(json, "device");
  const auto period = json.find("period_s");
  header.period = period != json.end() && period->is_number() ? period->get<double>() : 0.0;
  header.planned_cycles = count_of(json, "planned_cycles");
  header.full_order_states = count_of(json, "full_order_states");
  header.segment = count_of(json, "segment");
  const auto fields = json.find("fields");
  if (fields == json.end() || !fields->is_array() || fields->empty() ||
      fields->size() > kMostFields) {
    refuse(where, "the header names no fields", {}, "1 to 512 fields");
  }
  for (const Json& field : *fields) {
    if (!field.is_object()) refuse(where, "a field is no JSON object");
    header.fields.push_back(
        {text_of(field, "name"), text_of(field, "unit"), text_of(field, "type")});
    const std::string& type = header.fields.back().type;
    if (type != "f8" && type != "i8") refuse(where, "fields", type, "f8 or i8");
  }
  if (count_of(json, "record_bytes") != static_cast<std::int64_t>(8 * header.fields.size())) {
    refuse(where, "record_bytes does not fit the fields");
  }
  return {header, kPrefix + length + 8};
}

/// Maps this program's fields to those of the file, by name and type.
struct FieldMap {
  std::vector<std::pair<std::size_t, const CycleField*>> from_to;
  std::size_t missing = 0;
  std::size_t unknown = 0;
};

bool is_of(const LogHeader::Field& in_file, const CycleField& field) {
  return (in_file.name == field.name ||
          (!field.formerly.empty() && in_file.name == field.formerly)) &&
         in_file.unit == field.unit && in_file.type == type_in_log(field.type);
}

FieldMap map_fields(const LogHeader& header, const std::string& where) {
  FieldMap map;
  for (const CycleField& field : cycle_fields()) {
    const auto from =
        std::find_if(header.fields.begin(), header.fields.end(),
                     [&](const LogHeader::Field& in_file) { return is_of(in_file, field); });
    if (from != header.fields.end()) {
      map.from_to.emplace_back(static_cast<std::size_t>(from - header.fields.begin()), &field);
    } else if (field.name == "record" || field.name == "cycle") {
      refuse(where, "without this field no record can be read", {}, std::string(field.name));
    } else {
      ++map.missing;
    }
  }
  map.unknown = header.fields.size() - map.from_to.size();
  return map;
}

/// The complete block at `at`, or nothing.
std::optional<BlockHeader> block_at(std::string_view bytes, std::size_t at,
                                    std::size_t record_bytes) {
  BlockHeader header;
  if (bytes.size() - at < sizeof(header)) return {};
  std::memcpy(&header, bytes.data() + at, sizeof(header));
  if (header.magic != BlockHeader::kMagic || header.records > kBlockRecords) return {};
  const std::size_t size = sizeof(header) + header.records * record_bytes;
  if (bytes.size() - at < size) return {};
  if (!block_is_good(std::as_bytes(std::span(bytes.substr(at, size))))) return {};
  return header;
}

bool by_number(const LogRecord& a, const LogRecord& b) { return a.record < b.record; }

}  // namespace

LogContent parse_segment(std::string_view bytes, const std::string& where) {
  LogContent content;
  std::size_t at = 0;
  std::tie(content.header, at) = parse_header(bytes, where);
  const FieldMap map = map_fields(content.header, where);
  if (map.missing > 0 || map.unknown > 0) {
    content.remarks.push_back(
        fmt::format("{}: schema {}, {} fields of this program's are missing, {} are unknown", where,
                    content.header.schema, map.missing, map.unknown));
  }
  const std::size_t record_bytes = 8 * content.header.fields.size();
  const bool no_truth = content.header.schema < 3 && !content.header.device.empty();
  while (at < bytes.size()) {
    const auto block = block_at(bytes, at, record_bytes);
    if (!block) {  // look for the next one: blocks begin at multiples of 8
      const std::size_t step = std::min<std::size_t>(8, bytes.size() - at);
      content.bad_bytes += step;
      at += step;
      continue;
    }
    at += sizeof(BlockHeader);
    content.totals = block->totals;
    content.closed = content.closed || (block->flags & BlockHeader::kLast) != 0;
    for (std::uint32_t k = 0; k < block->records; ++k, at += record_bytes) {
      LogRecord record;
      for (const auto& [from, field] : map.from_to) {
        std::uint64_t bits = 0;
        std::memcpy(&bits, bytes.data() + at + 8 * from, 8);
        field->set(record, bits);
      }
      if (no_truth) record.truth = {.volume = LogRecord::kNone, .peak = LogRecord::kNone};
      content.records.push_back(record);
    }
  }
  if (content.bad_bytes > 0) {
    content.remarks.push_back(
        fmt::format("{}: {} bytes in no complete block", where, content.bad_bytes));
  }
  return content;
}

LogContent read_segments(const std::vector<std::filesystem::path>& files) {
  LogContent all;
  std::optional<Error> refused;
  bool first = true;
  for (const std::filesystem::path& file : files) {
    LogContent one;
    try {
      one = parse_segment(read_file(file.string(), kLargestSegment, "log segment"), file.string());
    } catch (const Error& error) {
      if (!refused) refused = error;
      all.remarks.emplace_back(error.what());
      continue;
    }
    if (!first && one.header.config_sha256 != all.header.config_sha256) {
      refuse(file.string(), "a segment of another run", one.header.config_sha256,
             all.header.config_sha256);
    }
    if (first) all.header = one.header;
    first = false;
    all.closed = all.closed || one.closed;
    if (one.totals.produced >= all.totals.produced) all.totals = one.totals;
    all.bad_bytes += one.bad_bytes;
    all.remarks.insert(all.remarks.end(), one.remarks.begin(), one.remarks.end());
    all.records.insert(all.records.end(), one.records.begin(), one.records.end());
  }
  if (first) {
    if (refused) throw *refused;
    throw Error(ErrorParts{.problem = "there is no log segment", .accepted = "one at least"});
  }
  std::stable_sort(all.records.begin(), all.records.end(), by_number);
  const auto last =
      std::unique(all.records.begin(), all.records.end(),
                  [](const LogRecord& a, const LogRecord& b) { return a.record == b.record; });
  all.records.erase(last, all.records.end());
  return all;
}

std::vector<std::filesystem::path> segments_of(const std::filesystem::path& run_folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(run_folder / "log", error)) {
    if (entry.path().extension() == ".seg") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace photocoag
