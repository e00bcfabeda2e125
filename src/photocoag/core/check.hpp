// Role: setup; range checks that name the field. Used by every settings aggregate's validate().
#pragma once

#include <string_view>

namespace photocoag {

/// Throws Error{key, found, accepted} unless `ok`. `accepted`: the range with its unit.
void require(bool ok, std::string_view key, double found, std::string_view accepted);
void require(bool ok, std::string_view key, std::string_view found, std::string_view accepted);

/// Throws unless `value` is finite and low <= value <= high.
void require_between(double value, double low, double high, std::string_view key);

/// Throws unless `value` is finite and 0 < value <= high.
void require_positive(double value, double high, std::string_view key);

}  // namespace photocoag
