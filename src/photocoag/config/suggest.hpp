// Role: setup; "did you mean". Used by config.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

/// The candidate nearest to the full key `written`, or "" if none is near. Case counts little; the
/// last part is also compared alone, so that a key in the wrong section is found.
std::string nearest_key(std::string_view written, const std::vector<std::string>& candidates);

}  // namespace photocoag
