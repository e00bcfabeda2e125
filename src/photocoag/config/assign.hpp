// Role: setup; one written value into one field. Used by config.
#pragma once

#include <string>

#include "photocoag/config/fields.hpp"
#include "photocoag/config/source.hpp"

namespace photocoag {

/// Converts `value` to the field's type and unit and stores it. A relative path is taken relative
/// to `folder` and stored absolute and normal. Ranges of numbers are left to the settings'
/// validate(). Not for layers. Throws Error with place, key, what was found and what is accepted.
void assign(const Field& field, const Value& value, const std::string& folder);

/// Throws the error that `value` is of the wrong type for `key`.
[[noreturn]] void refuse_type(const std::string& key, const Value& value, std::string accepted);

}  // namespace photocoag
