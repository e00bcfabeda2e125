// Role: setup; checks and conversions of UTF-8 text. Used by config, run_files.
#pragma once

#include <string>
#include <string_view>

namespace photocoag {

bool is_ascii(std::string_view text) noexcept;

/// False for truncated or overlong sequences, surrogates and code points beyond U+10FFFF.
bool is_utf8(std::string_view text) noexcept;

/// `text` with every invalid byte replaced by U+FFFD.
std::string valid_utf8(std::string_view text);

/// The same in UTF-16, the unit in which MATLAB counts characters.
std::u16string to_utf16(std::string_view text);

}  // namespace photocoag
