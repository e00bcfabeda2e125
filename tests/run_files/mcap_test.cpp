// An MCAP file read by what its specification says, not by what wrote it.
// (python/tests/test_mcap.py reads one with the format's own library.)
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "photocoag/core/files.hpp"
#include "photocoag/run_files/table.hpp"
#include "support/temporary_folder.hpp"
#include "support/thrown.hpp"

namespace photocoag::testing {
namespace {

constexpr std::size_t kRows = 5000;  // several chunks
const std::string kMagic("\x89MCAP0\r\n", 8);

DataTable example() {
  DataTable table{.about = {{"config", "a = 1"}}, .columns = {}};
  std::vector<double> time, peak;
  std::vector<std::int64_t> late;
  std::vector<std::string> word;
  for (std::size_t k = 0; k < kRows; ++k) {
    time.push_back(1e-3 * static_cast<double>(k + 1));
    peak.push_back(k == 7 ? std::numeric_limits<double>::quiet_NaN()
                          : 0.1 * static_cast<double>(k));
    late.push_back(k == 7 ? INT64_MIN : static_cast<std::int64_t>(k));
    word.push_back(k == 7 ? "a \"word\"" : "solved");
  }
  table.columns = {
      {"time_s", "s", time}, {"peak_K", "K", peak}, {"late_ns", "ns", late}, {"status", "-", word}};
  return table;
}

struct Reader {
  std::string bytes;
  std::size_t at = 0;

  std::uint64_t number(int size) {
    std::uint64_t value = 0;
    for (int k = 0; k < size; ++k) {
      value |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes.at(at++))) << (8 * k);
    }
    return value;
  }
  std::string take(std::size_t size) {
    at += size;
    return bytes.substr(at - size, size);
  }
  std::string text() { return take(number(4)); }
  bool done() const { return at >= bytes.size(); }
};

struct Record {
  int op;
  std::size_t start;  // of the record in its container
  Reader content;
};

std::vector<Record> records_of(const std::string& bytes, std::size_t at) {
  std::vector<Record> all;
  Reader reader{bytes, at};
  while (reader.bytes.size() - reader.at >= 9 && reader.bytes.substr(reader.at) != kMagic) {
    const std::size_t start = reader.at;
    const int op = static_cast<int>(reader.number(1));
    const std::uint64_t size = reader.number(8);
    all.push_back({op, start, Reader{reader.take(size)}});
  }
  return all;
}

std::uint64_t crc(const std::string& bytes) {
  return crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

class Mcap : public ::testing::Test {
 protected:
  Mcap() {
    write_mcap(folder_.file("t.mcap"), example());
    bytes_ = read_file(folder_.file("t.mcap"), 10'000'000);
    records_ = records_of(bytes_, kMagic.size());
  }
  std::vector<Record> of(int op) const {
    std::vector<Record> found;
    for (const Record& record : records_) {
      if (record.op == op) found.push_back(record);
    }
    return found;
  }
  TemporaryFolder folder_;
  std::string bytes_;
  std::vector<Record> records_;
};

TEST_F(Mcap, EveryMessageIsInAChunkWithItsCrcAndWhereTheIndexSays) {
  EXPECT_TRUE(bytes_.starts_with(kMagic));
  EXPECT_TRUE(bytes_.ends_with(kMagic));
  EXPECT_TRUE(of(0x05).empty()) << "no message outside the chunks";
  std::size_t messages = 0, indexed = 0;
  std::string chunk_bytes;
  for (const Record& record : records_) {
    Reader in = record.content;
    if (record.op == 0x06) {
      in.number(8);
      in.number(8);
      const std::uint64_t size = in.number(8);
      const std::uint64_t sum = in.number(4);
      EXPECT_EQ(in.text(), "") << "not compressed";
      chunk_bytes = in.take(in.number(8));
      EXPECT_TRUE(in.done());
      EXPECT_EQ(chunk_bytes.size(), size);
      EXPECT_EQ(crc(chunk_bytes), sum);
      messages += records_of(chunk_bytes, 0).size();
    } else if (record.op == 0x07) {
      const std::uint64_t channel = in.number(2);
      Reader entries{in.text()};
      while (!entries.done()) {
        const std::uint64_t time = entries.number(8);
        Reader message{chunk_bytes, entries.number(8)};
        EXPECT_EQ(message.number(1), 0x05U);
        message.number(8);
        ASSERT_EQ(message.number(2), channel);
        message.number(4);
        ASSERT_EQ(message.number(8), time);
        ++indexed;
      }
    }
  }
  EXPECT_GT(of(0x06).size(), 1U);
  EXPECT_EQ(messages, 4 * kRows);
  EXPECT_EQ(indexed, messages);
}

TEST_F(Mcap, TheSummaryIsWhereTheFooterSaysWithItsCrc) {
  ASSERT_EQ(of(0x02).size(), 1U);
  Reader footer = of(0x02).front().content;
  const std::size_t summary = footer.number(8);
  const std::size_t offsets = footer.number(8);
  const std::string covered = bytes_.substr(summary, bytes_.size() - summary - 4 - kMagic.size());
  EXPECT_EQ(footer.number(4), crc(covered));
  const Record end = of(0x0F).front();
  EXPECT_EQ(Reader(end.content).number(4), crc(bytes_.substr(0, end.start)));
  std::vector<int> groups;
  for (const Record& record : records_of(bytes_, offsets)) {
    if (record.op != 0x0E) continue;
    Reader in = record.content;
    const int op = static_cast<int>(in.number(1));
    groups.push_back(op);
    const std::size_t start = in.number(8);
    EXPECT_GE(start, summary);
    EXPECT_EQ(static_cast<int>(static_cast<unsigned char>(bytes_[start])), op);
  }
  EXPECT_EQ(groups, (std::vector<int>{0x03, 0x04, 0x0B, 0x08, 0x0D}));
  std::size_t chunk = 0;
  for (const Record& index : of(0x08)) {
    Reader in = index.content;
    in.number(8);
    in.number(8);
    EXPECT_EQ(in.number(8), of(0x06)[chunk++].start);
  }
  EXPECT_EQ(chunk, of(0x06).size());
}

TEST_F(Mcap, ChannelsCarryUnitsAndMissingValuesAreLeftOut) {
  const std::vector<Record> channels = of(0x04);
  ASSERT_EQ(channels.size(), 8U) << "four, once with the data and once in the summary";
  Reader channel = channels[1].content;
  EXPECT_EQ(channel.number(2), 2U);
  channel.number(2);
  EXPECT_EQ(channel.text(), "/temperature");
  EXPECT_EQ(channel.text(), "json");
  Reader map{channel.text()};
  EXPECT_EQ(map.text(), "unit of peak_K");
  EXPECT_EQ(map.text(), "K");
  Reader chunk = of(0x06).front().content;
  chunk.take(8 + 8 + 8 + 4 + 4);
  const std::vector<Record> messages = records_of(chunk.take(chunk.number(8)), 0);
  const auto json_of = [&](std::size_t message) {
    Reader in = messages[message].content;
    in.take(2 + 4 + 8 + 8);
    return nlohmann::json::parse(in.bytes.substr(in.at));
  };
  EXPECT_EQ(json_of(4 * 6 + 1)["peak_K"], 0.1 * 6.0);
  EXPECT_FALSE(json_of(4 * 7 + 1).contains("peak_K"));
  EXPECT_FALSE(json_of(4 * 7 + 2).contains("late_ns"));
  EXPECT_EQ(json_of(4 * 7 + 3)["status"], "a \"word\"");
}

TEST(McapFile, ATableWithoutTimeIsRefused) {
  const TemporaryFolder folder;
  DataTable table = example();
  table.columns.erase(table.columns.begin());
  EXPECT_NE(message_of([&] { write_mcap(folder.file("t"), table); }).find("no column time_s"),
            std::string::npos);
}

}  // namespace
}  // namespace photocoag::testing
