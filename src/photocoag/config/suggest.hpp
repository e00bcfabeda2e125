// Role: setup; "did you mean". Used by config.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

/// The candidate that is nearest to the full key `written`, or "" if none is near. Letters' case
/// counts little; the last part alone also counts, so that a key in the wrong section is found.
std::string nearest_key(std::string_view written, const std::vector<std::string>& candidates);

}  // namespace photocoag
