// Role: setup; text that is, or claims to be, UTF-8. Used by config, run_files, campaign.
#pragma once

#include <string>
#include <string_view>

namespace photocoag {

bool is_ascii(std::string_view text) noexcept;

/// True unless a byte belongs to no character: cut, overlong, surrogate or beyond U+10FFFF.
bool is_utf8(std::string_view text) noexcept;

/// `text` with U+FFFD for every byte that belongs to no character: always UTF-8.
std::string valid_utf8(std::string_view text);

/// The same in UTF-16, whose length is what MATLAB counts.
std::u16string to_utf16(std::string_view text);

}  // namespace photocoag
