// Role: setup; exact decimal conversion between the configuration's units and SI. Used by config.
// A power of ten is applied to the text, not to the number: "6.0" um is read as the double nearest
// to 6.0e-6, like the literal 6.0e-6, and every double has a text that reads back exactly.
#pragma once

#include <string>
#include <string_view>

namespace photocoag {

/// The double nearest to `text` times 10^exponent. `text` is a finite TOML number in decimal
/// digits; underscores and a leading plus are allowed. Too small for a double: 0. Minus zero
/// becomes zero.
double scaled_decimal(std::string_view text, int exponent);

/// The shortest decimal t with scaled_decimal(t, exponent) == value, as a TOML float.
std::string shortest_decimal(double value, int exponent);

}  // namespace photocoag
