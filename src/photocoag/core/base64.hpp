// Role: setup; base64 (RFC 4648). Used by core (VTK files), page. Real-time promise: none.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

std::string base64(std::span<const unsigned char> bytes);

/// Skips blanks and line ends. Throws Error naming `where` at any other character.
std::vector<unsigned char> from_base64(std::string_view text, const std::string& where);

}  // namespace photocoag
