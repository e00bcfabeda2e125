#include "photocoag/core/csv.hpp"

#include <gtest/gtest.h>

#include "support/thrown.hpp"

namespace photocoag {
namespace {

using testing::message_of;
using Cells = std::vector<std::string_view>;

const std::string kMark = "\xEF\xBB\xBF";

TEST(Csv, CellsLoseTheirQuotesAndKeepTheirCommas) {
  CsvReader rows("\"a\",b,\"c, \"\"d\"\"\"\r\n,\"\",\n\n1,2", "t.csv");
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.cells(), (Cells{"a", "b", "c, \"d\""}));
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.cells(), (Cells{"", "", ""}));
  EXPECT_FALSE(rows.blank());
  ASSERT_TRUE(rows.next());
  EXPECT_TRUE(rows.blank());
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.cells(), (Cells{"1", "2"}));
  EXPECT_EQ(rows.place(), "t.csv:4");
  EXPECT_FALSE(rows.next());
}

TEST(Csv, OneByteOrderMarkIsSkippedTwoAreRefused) {
  for (const std::string header : {"a,b\n", "\"a\",\"b\"\n"}) {
    CsvReader rows(kMark + header, "t.csv");
    ASSERT_TRUE(rows.next());
    EXPECT_EQ(rows.cells(), (Cells{"a", "b"}));
  }
  EXPECT_NE(message_of([] { CsvReader(kMark + kMark + "a\n", "t.csv"); }).find("t.csv:1"),
            std::string::npos);
}

TEST(Csv, ZeroBytesAndOpenQuotesAreRefusedWithTheirLine) {
  const std::string zero("a\n1\0002\n", 6);
  EXPECT_NE(message_of([&] { CsvReader(zero, "t.csv"); }).find("t.csv:2: a zero byte"),
            std::string::npos);
  for (const std::string row : {"\"b", "\"b\"c,d", "x,\""}) {
    CsvReader rows("a\n" + row + "\n", "t.csv");
    ASSERT_TRUE(rows.next());
    EXPECT_NE(message_of([&] { rows.next(); }).find("t.csv:2"), std::string::npos) << row;
  }
}

}  // namespace
}  // namespace photocoag
