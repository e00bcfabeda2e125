// Base64: RFC 4648's own examples, and breaks wherever they are.
#include "photocoag/core/base64.hpp"

#include <gtest/gtest.h>

#include <string>

#include "support/thrown.hpp"

namespace photocoag {
namespace {

std::string encoded(const std::string& text) {
  return base64({reinterpret_cast<const unsigned char*>(text.data()), text.size()});
}

std::string decoded(const std::string& text) {
  const std::vector<unsigned char> bytes = from_base64(text, "here");
  return {bytes.begin(), bytes.end()};
}

std::string with(std::string text, std::size_t at, char more) {
  text.insert(text.begin() + static_cast<std::ptrdiff_t>(at), more);
  return text;
}

TEST(Base64, IsThatOfRfc4648) {
  const std::string plain = "foobar";
  const char* const coded[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"};
  for (std::size_t size = 0; size <= plain.size(); ++size) {
    EXPECT_EQ(encoded(plain.substr(0, size)), coded[size]);
    EXPECT_EQ(decoded(coded[size]), plain.substr(0, size));
  }
}

TEST(Base64, BreaksMayBeAnywhere) {
  std::string plain;
  for (int value = 0; value < 256; ++value) plain += static_cast<char>(value * 7);
  const std::string coded = encoded(plain);
  EXPECT_EQ(decoded(coded), plain);
  for (std::size_t at = 0; at <= coded.size(); ++at) {
    EXPECT_EQ(decoded(with(coded, at, '\n')), plain) << at;
    EXPECT_EQ(decoded(with(with(coded, at, ' '), at, '\n')), plain) << at;
  }
}

TEST(Base64, WhatIsNoDigitIsNamedWhereverItStands) {
  for (std::size_t at = 0; at <= 8; ++at) {
    const std::string message = testing::message_of([at] { decoded(with("Zm9vYmFy", at, '?')); });
    EXPECT_NE(message.find("not base64"), std::string::npos) << at;
    EXPECT_NE(message.find("?"), std::string::npos) << at;
  }
}

}  // namespace
}  // namespace photocoag
