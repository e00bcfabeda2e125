#include "photocoag/core/base64.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// Value of each byte as a base64 digit; 64: not a digit.
constexpr std::array<unsigned char, 256> kValues = [] {
  std::array<unsigned char, 256> values{};
  values.fill(64);
  for (unsigned char i = 0; i < 64; ++i) values[static_cast<unsigned char>(kDigits[i])] = i;
  return values;
}();

}  // namespace

std::string base64(std::span<const unsigned char> bytes) {
  std::string text((bytes.size() + 2) / 3 * 4, '=');
  char* digit = text.data();
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i) group = group << 8 | (i < count ? bytes[k + i] : 0U);
    for (std::size_t i = 0; i <= count; ++i) digit[i] = kDigits[group >> (18 - 6 * i) & 63U];
    digit += 4;
  }
  return text;
}

std::vector<unsigned char> from_base64(std::string_view text, const std::string& where) {
  std::vector<unsigned char> bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t group = 0;
  int bits = 0;
  const auto value_of = [&](std::size_t k) -> std::uint32_t {
    return kValues[static_cast<unsigned char>(text[k])];
  };
  for (std::size_t k = 0; k < text.size(); ++k) {
    // Four digits at once, nearly everywhere.
    while (bits == 0 && k + 4 <= text.size()) {
      const std::uint32_t a = value_of(k), b = value_of(k + 1), c = value_of(k + 2),
                          d = value_of(k + 3);
      if (((a | b | c | d) & 64U) != 0) break;
      const std::uint32_t all = a << 18 | b << 12 | c << 6 | d;
      for (const int shift : {16, 8, 0}) {
        bytes.push_back(static_cast<unsigned char>(all >> shift & 255U));
      }
      k += 4;
    }
    if (k == text.size()) break;
    const char c = text[k];
    if (c == '=' || c == '\n' || c == ' ') continue;
    const unsigned digit = kValues[static_cast<unsigned char>(c)];
    if (digit == 64) {
      throw Error(ErrorParts{.where = where, .problem = "not base64", .found = std::string(1, c)});
    }
    group = group << 6 | digit;
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes.push_back(static_cast<unsigned char>(group >> bits & 255U));
    }
  }
  return bytes;
}

}  // namespace photocoag
