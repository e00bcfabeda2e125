// Lines of documents are at most 120 characters long. Tables, code and what cannot be broken aside.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "docs/documents.hpp"

namespace photocoag::testing {
namespace {

constexpr std::size_t kLongest = 120;

// Characters, not bytes.
std::size_t length_of(const std::string& line) {
  return static_cast<std::size_t>(
      std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

// A table, a formula of one line, a picture, or text with `code` that fills the line.
bool unbreakable(const std::string& line) {
  const std::size_t first = line.find_first_not_of(' ');
  const std::string text = first == std::string::npos ? "" : line.substr(first);
  if (text.starts_with("|") || text.starts_with("$$") || text.starts_with("![")) return true;
  const std::size_t open = text.find('`');
  return open <= 1 && text.rfind('`') + kLongest / 10 > text.size() &&
         std::count(text.begin(), text.end(), '`') == 2;
}

TEST(LineLength, OfDocumentsIsAtMost120Characters) {
  std::size_t lines = 0;
  for (const auto& file : documents()) {
    for (const std::string& line : lines_of(text_of(file), false)) {
      ++lines;
      EXPECT_TRUE(length_of(line) <= kLongest || unbreakable(line))
          << file << ": " << length_of(line) << " characters: " << line;
    }
  }
  EXPECT_GT(lines, 1000U);
}

TEST(LineLength, WhatCannotBeBrokenIsATableAFormulaAPictureOrCode) {
  EXPECT_TRUE(unbreakable("| a | b |"));
  EXPECT_TRUE(unbreakable("$$a + b$$"));
  EXPECT_TRUE(unbreakable("(`simulate --set a=b`):"));
  EXPECT_FALSE(unbreakable("plain words and `code` and words"));
  EXPECT_EQ(length_of("µs"), 2U);
}

}  // namespace
}  // namespace photocoag::testing
