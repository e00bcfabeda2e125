// Role: setup; assigns a written value to a field. Used by config.
#pragma once

#include <string>

#include "photocoag/config/fields.hpp"
#include "photocoag/config/source.hpp"

namespace photocoag {

/// Converts `value` to the field's type and unit and stores it. A relative path is resolved against
/// `folder` and stored absolute and normalized. Ranges are checked later, by the settings'
/// validate(). Not for layers. Throws Error with place, key, what was found and what is accepted.
void assign(const Field& field, const Value& value, const std::string& folder);

/// Throws the error that `value` is of the wrong type for `key`.
[[noreturn]] void refuse_type(const std::string& key, const Value& value, std::string accepted);

}  // namespace photocoag
