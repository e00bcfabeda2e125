// Role: the program; the secret that a client of the console must know. Used by server, apps.
#pragma once

#include <string>
#include <string_view>

namespace photocoag {

/// 32 hexadecimal digits from the system's random source. Throws Error.
std::string random_token();

/// Constant-time comparison.
bool same_secret(std::string_view a, std::string_view b) noexcept;

}  // namespace photocoag
