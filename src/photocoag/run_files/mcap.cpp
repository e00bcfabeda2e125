// A table as an MCAP file: messages in JSON, one channel per kind of quantity, chunks with their
// CRC and index, a summary at the end. No compression, so that any reader can open it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <utility>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/utf8.hpp"
#include "photocoag/log/segment.hpp"
#include "photocoag/log/topics.hpp"
#include "photocoag/run_files/table.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;
constexpr std::string_view kMagic = "\x89MCAP0\r\n";
constexpr std::size_t kChunkBytes = 256 * 1024;

enum class Op : unsigned char {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Bytes of a record, little-endian.
class Bytes {
 public:
  template <typename T>
  Bytes& number(T value) {
    for (std::size_t k = 0; k < sizeof(T); ++k) {
      bytes_ += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * k));
    }
    return *this;
  }
  Bytes& raw(std::string_view text) {
    bytes_ += text;
    return *this;
  }
  /// A string, an array or a map: its length in bytes, then its bytes.
  Bytes& sized(std::string_view content) {
    return number(static_cast<std::uint32_t>(content.size())).raw(content);
  }
  Bytes& sized(const Bytes& content) { return sized(content.bytes_); }
  const std::string& text() const noexcept { return bytes_; }

 private:
  std::string bytes_;
};

std::string record(Op op, const Bytes& content) {
  return Bytes()
      .number(static_cast<unsigned char>(op))
      .number(static_cast<std::uint64_t>(content.text().size()))
      .raw(content.text())
      .text();
}

std::uint32_t crc_of(std::string_view bytes) { return crc32(std::as_bytes(std::span(bytes))); }

Bytes pairs(const std::vector<std::pair<std::string, std::string>>& all) {
  Bytes bytes;
  for (const auto& [key, value] : all) bytes.sized(valid_utf8(key)).sized(valid_utf8(value));
  return bytes;
}

/// What one topic holds: the columns of one unit.
struct Channel {
  std::string topic;
  std::vector<const TableColumn*> columns;
  std::uint64_t messages = 0;
};

std::vector<Channel> channels_of(const DataTable& table) {
  std::vector<Channel> channels;
  for (const TableColumn& column : table.columns) {
    const std::string topic(topic_of(
        column.name, column.unit, std::holds_alternative<std::vector<std::string>>(column.values)));
    const auto found = std::find_if(channels.begin(), channels.end(),
                                    [&](const Channel& one) { return one.topic == topic; });
    Channel& channel = found != channels.end() ? *found : channels.emplace_back();
    channel.topic = topic;
    channel.columns.push_back(&column);
  }
  return channels;
}

std::string schema_of(const Channel& channel) {
  Json schema = {{"type", "object"}, {"title", channel.topic.substr(1)}};
  for (const TableColumn* column : channel.columns) {
    const char* type = std::holds_alternative<std::vector<double>>(column->values) ? "number"
                       : std::holds_alternative<std::vector<std::int64_t>>(column->values)
                           ? "integer"
                           : "string";
    schema["properties"][column->name] = {{"type", type}, {"description", "unit " + column->unit}};
  }
  return schema.dump();
}

// Missing values are omitted.
std::string message_of(const Channel& channel, std::size_t row) {
  std::string text = "{";
  const auto add = [&](const std::string& name, const std::string& value) {
    fmt::format_to(std::back_inserter(text), "{}\"{}\":{}", text.size() > 1 ? "," : "", name,
                   value);
  };
  for (const TableColumn* column : channel.columns) {
    if (const auto* reals = std::get_if<std::vector<double>>(&column->values)) {
      if (std::isfinite((*reals)[row])) add(column->name, fmt::format("{}", (*reals)[row]));
    } else if (const auto* whole = std::get_if<std::vector<std::int64_t>>(&column->values)) {
      if ((*whole)[row] != INT64_MIN) add(column->name, fmt::format("{}", (*whole)[row]));
    } else {
      const std::string& word = std::get<std::vector<std::string>>(column->values)[row];
      if (!word.empty()) add(column->name, Json(valid_utf8(word)).dump());
    }
  }
  return text + "}";
}

/// Writes the file's parts in their order.
class Writer {
 public:
  explicit Writer(const DataTable& table) : table_(table), channels_(channels_of(table)) {}

  std::string file() {
    file_ = kMagic;
    file_ += record(Op::kHeader, Bytes().sized("").sized(fmt::format("photocoag {}", version())));
    for (std::size_t k = 0; k < channels_.size(); ++k) describe(k);
    metadata();
    const std::vector<std::uint64_t> times = times_of();
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      for (std::size_t k = 0; k < channels_.size(); ++k) add(k, row, times[row]);
      if (chunk_.size() >= kChunkBytes) end_chunk();
    }
    end_chunk();
    file_ += record(Op::kDataEnd, Bytes().number(crc_of(file_)));
    summary();
    return file_;
  }

 private:
  // Since the treatment's start, ns.
  std::vector<std::uint64_t> times_of() const {
    std::vector<std::uint64_t> times(table_.rows());
    for (const TableColumn& column : table_.columns) {
      const auto* reals = std::get_if<std::vector<double>>(&column.values);
      if (column.name != "time_s" || reals == nullptr) continue;
      for (std::size_t row = 0; row < times.size(); ++row) {
        times[row] = static_cast<std::uint64_t>(std::max(0.0, std::round((*reals)[row] * 1e9)));
      }
      return times;
    }
    throw Error(ErrorParts{.problem = "no column time_s", .accepted = "a run"});
  }

  void describe(std::size_t k) {
    const Channel& channel = channels_[k];
    const auto id = static_cast<std::uint16_t>(k + 1);
    std::vector<std::pair<std::string, std::string>> units;
    for (const TableColumn* column : channel.columns) {
      units.emplace_back("unit of " + column->name, column->unit);
    }
    const std::string schema = record(Op::kSchema, Bytes()
                                                       .number(id)
                                                       .sized("photocoag" + channel.topic)
                                                       .sized("jsonschema")
                                                       .sized(schema_of(channel)));
    const std::string itself = record(
        Op::kChannel,
        Bytes().number(id).number(id).sized(channel.topic).sized("json").sized(pairs(units)));
    schemas_ += schema;
    descriptions_ += itself;
    file_ += schema + itself;
  }

  void metadata() {
    const std::string about =
        record(Op::kMetadata, Bytes().sized("run").sized(pairs(table_.about)));
    metadata_index_ = record(Op::kMetadataIndex, Bytes()
                                                     .number<std::uint64_t>(file_.size())
                                                     .number<std::uint64_t>(about.size())
                                                     .sized("run"));
    file_ += about;
  }

  void add(std::size_t k, std::size_t row, std::uint64_t time) {
    index_[k].number(time).number<std::uint64_t>(chunk_.size());
    chunk_ += record(Op::kMessage, Bytes()
                                       .number(static_cast<std::uint16_t>(k + 1))
                                       .number(static_cast<std::uint32_t>(row))
                                       .number(time)
                                       .number(time)
                                       .raw(message_of(channels_[k], row)));
    ++channels_[k].messages;
    if (std::exchange(first_in_chunk_, false)) chunk_begin_ = time;
    chunk_end_ = time;
    if (messages_++ == 0) begin_ = time;
    end_ = time;
  }

  void end_chunk() {
    if (chunk_.empty()) return;
    const std::uint64_t start = file_.size();
    const std::string chunk = record(Op::kChunk, Bytes()
                                                     .number(chunk_begin_)
                                                     .number(chunk_end_)
                                                     .number<std::uint64_t>(chunk_.size())
                                                     .number(crc_of(chunk_))
                                                     .sized("")
                                                     .number<std::uint64_t>(chunk_.size())
                                                     .raw(chunk_));
    file_ += chunk;
    Bytes offsets;
    const std::uint64_t index_start = file_.size();
    for (const auto& [k, entries] : index_) {
      const auto id = static_cast<std::uint16_t>(k + 1);
      offsets.number(id).number<std::uint64_t>(file_.size());
      file_ += record(Op::kMessageIndex, Bytes().number(id).sized(entries));
    }
    chunk_indices_ += record(Op::kChunkIndex, Bytes()
                                                  .number(chunk_begin_)
                                                  .number(chunk_end_)
                                                  .number(start)
                                                  .number<std::uint64_t>(chunk.size())
                                                  .sized(offsets)
                                                  .number<std::uint64_t>(file_.size() - index_start)
                                                  .sized("")
                                                  .number<std::uint64_t>(chunk_.size())
                                                  .number<std::uint64_t>(chunk_.size()));
    ++chunks_;
    chunk_.clear();
    index_.clear();
    first_in_chunk_ = true;
  }

  std::string statistics() const {
    Bytes counts;
    for (std::size_t k = 0; k < channels_.size(); ++k) {
      counts.number(static_cast<std::uint16_t>(k + 1)).number(channels_[k].messages);
    }
    return record(Op::kStatistics, Bytes()
                                       .number(messages_)
                                       .number(static_cast<std::uint16_t>(channels_.size()))
                                       .number(static_cast<std::uint32_t>(channels_.size()))
                                       .number(std::uint32_t{0})  // attachments
                                       .number(std::uint32_t{1})  // metadata
                                       .number(chunks_)
                                       .number(begin_)
                                       .number(end_)
                                       .sized(counts));
  }

  void summary() {
    const std::uint64_t start = file_.size();
    std::string offsets;
    const auto group = [&](Op op, const std::string& records) {
      if (records.empty()) return;
      offsets += record(Op::kSummaryOffset, Bytes()
                                                .number(static_cast<unsigned char>(op))
                                                .number<std::uint64_t>(file_.size())
                                                .number<std::uint64_t>(records.size()));
      file_ += records;
    };
    group(Op::kSchema, schemas_);
    group(Op::kChannel, descriptions_);
    group(Op::kStatistics, statistics());
    group(Op::kChunkIndex, chunk_indices_);
    group(Op::kMetadataIndex, metadata_index_);
    const std::uint64_t offsets_start = file_.size();
    file_ += offsets;
    constexpr std::uint64_t kFooterBytes = 20;
    file_ += Bytes()
                 .number(static_cast<unsigned char>(Op::kFooter))
                 .number(kFooterBytes)
                 .number(start)
                 .number(offsets_start)
                 .text();
    // Of all of the summary and the footer up to here.
    file_ += Bytes().number(crc_of(std::string_view(file_).substr(start))).text();
    file_ += kMagic;
  }

  const DataTable& table_;
  std::vector<Channel> channels_;
  std::string file_, schemas_, descriptions_, metadata_index_, chunk_indices_;
  std::string chunk_;                   // its records so far
  std::map<std::size_t, Bytes> index_;  // of its messages, by channel
  bool first_in_chunk_ = true;
  std::uint64_t chunk_begin_ = 0, chunk_end_ = 0, begin_ = 0, end_ = 0, messages_ = 0;
  std::uint32_t chunks_ = 0;
};

}  // namespace

void write_mcap(const std::string& file, const DataTable& table) {
  try {
    write_file(file, Writer(table).file());
  } catch (const Error& error) {
    throw error.at(file);
  }
}

}  // namespace photocoag
