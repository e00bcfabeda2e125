// Role: everywhere; identifies the build that wrote a file.
#pragma once

#include <string_view>

namespace photocoag {

/// Semantic version of the project, e.g. "0.1.0".
std::string_view version() noexcept;
/// First 16 hexadecimal digits of a SHA-256 over all sources below src/: the code version.
std::string_view source_hash() noexcept;

/// Shown wherever users look.
inline constexpr std::string_view kResearchNotice =
    "Research software, not a medical device: not certified, not for use on humans.";

}  // namespace photocoag
