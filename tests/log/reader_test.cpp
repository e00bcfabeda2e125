// Whatever has happened to a segment: all complete blocks come out, nothing else does.
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>

#include "log/segments.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"
#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

const std::size_t kBlockBytes = sizeof(BlockHeader) + 5 * log_record_bytes();

std::size_t pick(std::uint64_t index, std::size_t below) {
  return static_cast<std::size_t>(uniform(3, index, RandomStream::kTest) *
                                  static_cast<double>(below));
}

std::string thrown(const std::string& bytes) {
  try {
    parse_segment(bytes, "a.seg");
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

/// With another header text, sealed again.
std::string with_header(const std::string& segment, const nlohmann::ordered_json& json) {
  std::string text = json.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');
  std::string bytes = segment.substr(0, 12);
  const auto append = [&bytes](std::uint32_t number) {
    bytes.append(reinterpret_cast<const char*>(&number), 4);
  };
  append(static_cast<std::uint32_t>(text.size()));
  bytes += text;
  append(crc32(std::as_bytes(std::span(bytes))));
  append(0);
  return bytes;
}

nlohmann::ordered_json header_json(const std::string& segment) {
  std::uint32_t length = 0;
  std::memcpy(&length, segment.data() + 12, 4);
  return nlohmann::ordered_json::parse(segment.substr(16, length));
}

TEST(LogReader, EveryFieldComesBackBitByBit) {
  const LogContent content = parse_segment(segment_of(3), "a.seg");
  ASSERT_EQ(content.records.size(), 15u);
  EXPECT_EQ(content.bad_bytes, 0u);
  EXPECT_FALSE(content.closed);
  EXPECT_EQ(content.header.config_sha256, "c0ffee");
  for (std::int64_t k = 0; k < 15; ++k) {
    LogRecord expected = record_of(k);
    expected.record = k;
    EXPECT_EQ(packed(content.records[static_cast<std::size_t>(k)]), packed(expected));
  }
}

// Each row has a place of its own in the record: set alone, it alone differs and comes back.
TEST(LogReader, EveryRowOfTheTableHasItsOwnPlace) {
  const LogRecord empty;
  for (const CycleField& field : cycle_fields()) {
    std::uint64_t other = field.get(empty) == 1 ? 0 : 1;
    if (field.type == FieldType::kReal) other = std::bit_cast<std::uint64_t>(0.125);
    LogRecord record;
    field.set(record, other);
    for (const CycleField& also : cycle_fields()) {
      EXPECT_EQ(also.get(record), also.name == field.name ? other : also.get(empty))
          << field.name << " and " << also.name;
    }
    EXPECT_EQ(field_named(field.name), &field) << "a name twice";
  }
}

TEST(LogReader, CutOffAnywhereTheCompleteBlocksComeOut) {
  const std::string whole = segment_of(6);
  const std::size_t head = whole.size() - 6 * kBlockBytes;
  for (std::uint64_t trial = 0; trial < 400; ++trial) {
    const std::size_t length = pick(trial, whole.size() + 1);
    if (length < head) {
      EXPECT_FALSE(thrown(whole.substr(0, length)).empty()) << length;
      continue;
    }
    const LogContent content = parse_segment(std::string_view(whole).substr(0, length), "a.seg");
    EXPECT_EQ(content.records.size(), (length - head) / kBlockBytes * 5) << length;
    EXPECT_EQ(content.bad_bytes, (length - head) % kBlockBytes);
  }
}

TEST(LogReader, AFlippedBitCostsItsBlockAndNoOther) {
  const std::string whole = segment_of(6);
  const std::size_t head = whole.size() - 6 * kBlockBytes;
  for (std::uint64_t trial = 0; trial < 400; ++trial) {
    std::string bytes = whole;
    const std::size_t at = pick(trial, whole.size());
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << pick(trial + 1000, 8)));
    if (at < head) {
      // The four zero bytes that only fill up are not covered.
      EXPECT_EQ(thrown(bytes).empty(), at + 4 >= head) << at;
      continue;
    }
    const LogContent content = parse_segment(bytes, "a.seg");
    EXPECT_EQ(content.records.size(), 25u) << at;
    const auto lost = static_cast<std::int64_t>((at - head) / kBlockBytes * 5);
    for (const LogRecord& record : content.records) {
      EXPECT_TRUE(record.record < lost || record.record >= lost + 5);
      EXPECT_EQ(std::bit_cast<std::uint64_t>(record.power),
                std::bit_cast<std::uint64_t>(record_of(record.record).power));
    }
  }
}

TEST(LogReader, ACountThatLiesReadsNothingBeyondTheFile) {
  std::string bytes = segment_of(2);
  const std::size_t head = bytes.size() - 2 * kBlockBytes;
  for (const std::uint32_t count : {6u, 255u, 256u, 257u, 0x7fffffffu, 0xffffffffu}) {
    std::memcpy(bytes.data() + head + kBlockBytes + 8, &count, 4);
    EXPECT_EQ(parse_segment(bytes, "a.seg").records.size(), 5u) << count;
  }
}

TEST(LogReader, HeadersThatAreRefused) {
  const std::string good = segment_of(1);
  EXPECT_NE(thrown(""), "");
  EXPECT_NE(thrown(std::string(100, '\0')), "");
  std::string other_format = good;
  other_format[8] = 2;
  EXPECT_NE(thrown(other_format).find("another format"), std::string::npos);
  const auto refused = [&](auto change) {
    nlohmann::ordered_json json = header_json(good);
    change(json);
    return thrown(with_header(good, json));
  };
  EXPECT_EQ(refused([](auto&) {}), "") << "the test's own seal is right";
  EXPECT_NE(refused([](auto& json) { json = "text"; }), "");
  EXPECT_NE(refused([](auto& json) { json.erase("fields"); }), "");
  EXPECT_NE(refused([](auto& json) { json["fields"] = nlohmann::ordered_json::array(); }), "");
  EXPECT_NE(refused([](auto& json) { json["fields"][3]["type"] = "f4"; }), "");
  EXPECT_NE(refused([](auto& json) { json["record_bytes"] = 7; }), "");
  EXPECT_NE(refused([](auto& json) { json["fields"][1]["name"] = "kycle"; }), "");
}

TEST(LogReader, OtherSchemasAreReadByName) {
  // An older program without the last field; a newer one with one more in the middle.
  const std::string good = segment_of(1);
  nlohmann::ordered_json older = header_json(good);
  older["schema"] = 0;
  older["fields"].erase(older["fields"].size() - 1);
  older["record_bytes"] = older["fields"].size() * 8;
  std::string bytes = with_header(good, older);
  BlockHeader head;
  head.records = 2;
  std::string block(reinterpret_cast<const char*>(&head), sizeof(head));
  for (std::int64_t k = 100; k < 102; ++k) {
    LogRecord record = record_of(k);
    record.record = k;
    record.end.innovation_sigma = 7.0;  // not in the file
    block += packed(record).substr(0, log_record_bytes() - 8);
  }
  seal_block(std::as_writable_bytes(std::span(block)));
  bytes += block;
  LogContent content = parse_segment(bytes, "old.seg");
  ASSERT_EQ(content.records.size(), 2u);
  EXPECT_EQ(content.records[1].cycle, 101);
  EXPECT_EQ(content.records[1].power, record_of(101).power);
  EXPECT_TRUE(std::isnan(content.records[1].end.innovation_sigma));
  ASSERT_EQ(content.remarks.size(), 1u);

  nlohmann::ordered_json newer = header_json(good);
  newer["schema"] = kLogSchema + 1;
  newer["fields"].insert(
      newer["fields"].begin() + 2,
      nlohmann::ordered_json::object({{"name", "new_K"}, {"unit", "K"}, {"type", "f8"}}));
  newer["record_bytes"] = newer["fields"].size() * 8;
  LogRecord record = record_of(42);
  std::string raw = packed(record);
  raw.insert(16, 8, 'x');
  head.records = 1;
  block.assign(reinterpret_cast<const char*>(&head), sizeof(head));
  block += raw;
  seal_block(std::as_writable_bytes(std::span(block)));
  content = parse_segment(with_header(good, newer) + block, "new.seg");
  ASSERT_EQ(content.records.size(), 1u);
  EXPECT_EQ(content.records[0].time, record.time);
  EXPECT_EQ(content.records[0].power, record.power);

  // All three in one folder: one run, three schemas.
  const TemporaryFolder folder;
  const auto put = [&](const char* name, const std::string& text) {
    std::ofstream(folder.path() / name, std::ios::binary) << text;
    return folder.path() / name;
  };
  content = read_segments({put("0.seg", good), put("1.seg", bytes),
                           put("2.seg", with_header(good, newer) + block),
                           put("3.seg", "no segment at all")});
  EXPECT_EQ(content.records.size(), 5u + 2u + 0u + 0u)
      << "the newer one's record has number 0, which was there already";
  EXPECT_EQ(content.remarks.size(), 3u);
  // Another run's segment is refused.
  nlohmann::ordered_json foreign = header_json(good);
  foreign["config_sha256"] = "other";
  EXPECT_THROW(read_segments({put("0.seg", good), put("4.seg", with_header(good, foreign))}),
               Error);
  EXPECT_THROW(read_segments({}), Error);
  EXPECT_THROW(read_segments({put("3.seg", "no segment at all")}), Error);
}

}  // namespace
}  // namespace photocoag::testing
