#include "photocoag/core/utf8.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace photocoag {
namespace {

TEST(Utf8, CharactersAreCountedAsUtf16CountsThem) {
  EXPECT_EQ(to_utf16("läuft"), u"läuft");
  EXPECT_EQ(to_utf16("läuft").size(), 5U);
  EXPECT_EQ(to_utf16("α ⁂ 🔦"), u"α ⁂ 🔦");
  EXPECT_EQ(to_utf16("🔦").size(), 2U);
  EXPECT_TRUE(is_ascii("run/1~"));
  EXPECT_FALSE(is_ascii("läuft"));
}

// The cases of RFC 3629: cut, overlong, surrogates, beyond the last character, bytes that never
// begin one.
TEST(Utf8, WhatIsNoCharacterIsReplacedByteByByte) {
  const std::vector<std::pair<std::string, std::size_t>> bad = {
      {"\xC3", 1},         {"\xE2\x82", 2},     {"\xC0\x80", 2},
      {"\xE0\x80\x80", 3}, {"\xED\xA0\x80", 3}, {"\xF4\x90\x80\x80", 4},
      {"\xFF", 1},         {"\x80", 1},         {"\xF0\x8F\xBF\xBF", 4}};
  for (const auto& [bytes, count] : bad) {
    std::string expected = "a";
    for (std::size_t i = 0; i < count; ++i) expected += "\xEF\xBF\xBD";
    EXPECT_FALSE(is_utf8("a" + bytes + "b"));
    EXPECT_EQ(valid_utf8("a" + bytes + "b"), expected + "b");
    EXPECT_EQ(to_utf16("a" + bytes + "b"), u"a" + std::u16string(count, u'\xFFFD') + u"b");
  }
  const std::string good =
      "\x7F\xC2\x80\xDF\xBF\xE0\xA0\x80\xED\x9F\xBF\xEE\x80\x80\xF4\x8F\xBF\xBF";
  EXPECT_TRUE(is_utf8(good));
  EXPECT_EQ(valid_utf8(good), good);
}

}  // namespace
}  // namespace photocoag
