#include "photocoag/core/utf8.hpp"

#include <algorithm>
#include <cstddef>

namespace photocoag {
namespace {

constexpr char32_t kReplacement = 0xFFFD;

struct Character {
  char32_t code;
  std::size_t bytes;
  bool good;
};

unsigned byte_at(std::string_view text, std::size_t at) noexcept {
  return at < text.size() ? static_cast<unsigned char>(text[at]) : 0U;
}

// The first character of `text`, which is not empty; an invalid byte counts as one.
Character front_of(std::string_view text) noexcept {
  const unsigned lead = byte_at(text, 0);
  if (lead < 0x80U) return {lead, 1, true};
  const std::size_t bytes = lead >= 0xF0U ? 4 : lead >= 0xE0U ? 3 : 2;
  char32_t code = lead & (0xFFU >> (bytes + 1));
  bool good = lead >= 0xC2U && lead <= 0xF4U;
  for (std::size_t i = 1; i < bytes; ++i) {
    const unsigned next = byte_at(text, i);
    good = good && (next & 0xC0U) == 0x80U;
    code = (code << 6U) | (next & 0x3FU);
  }
  const char32_t least = bytes == 4 ? 0x10000 : bytes == 3 ? 0x800 : 0x80;
  good = good && code >= least && code <= 0x10FFFF && (code < 0xD800 || code > 0xDFFF);
  return good ? Character{code, bytes, true} : Character{kReplacement, 1, false};
}

}  // namespace

bool is_ascii(std::string_view text) noexcept {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x80U; });
}

bool is_utf8(std::string_view text) noexcept {
  for (; !text.empty();) {
    const Character next = front_of(text);
    if (!next.good) return false;
    text.remove_prefix(next.bytes);
  }
  return true;
}

std::string valid_utf8(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const Character next = front_of(text);
    if (next.good) {
      result += text.substr(0, next.bytes);
    } else {
      result += "\xEF\xBF\xBD";
    }
    text.remove_prefix(next.bytes);
  }
  return result;
}

std::u16string to_utf16(std::string_view text) {
  std::u16string result;
  while (!text.empty()) {
    const Character next = front_of(text);
    if (next.code < 0x10000) {
      result += static_cast<char16_t>(next.code);
    } else {
      result += static_cast<char16_t>(0xD7C0 + (next.code >> 10U));
      result += static_cast<char16_t>(0xDC00 + (next.code & 0x3FFU));
    }
    text.remove_prefix(next.bytes);
  }
  return result;
}

}  // namespace photocoag
