// Role: setup; range checks that name the field. Used by every settings aggregate's validate().
#pragma once

#include <string_view>

namespace photocoag {

/// Throws Error{key, found, accepted} unless `ok`. `accepted`: the range with its unit.
void require(bool ok, std::string_view key, double found, std::string_view accepted);
void require(bool ok, std::string_view key, std::string_view found, std::string_view accepted);

}  // namespace photocoag
