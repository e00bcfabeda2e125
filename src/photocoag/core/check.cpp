#include "photocoag/core/check.hpp"

#include <fmt/format.h>
#include <cmath>

#include "photocoag/core/error.hpp"

namespace photocoag {

void require(bool ok, std::string_view key, std::string_view found, std::string_view accepted) {
  if (ok) return;
  throw Error(ErrorParts{
      .key = std::string(key), .found = std::string(found), .accepted = std::string(accepted)});
}

void require(bool ok, std::string_view key, double found, std::string_view accepted) {
  if (!ok) require(false, key, fmt::format("{}", found), accepted);
}

void require_between(double value, double low, double high, std::string_view key) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  require(false, key, value, fmt::format("a number from {} to {}", low, high));
}

void require_positive(double value, double high, std::string_view key) {
  if (std::isfinite(value) && value > 0.0 && value <= high) return;
  require(false, key, value, fmt::format("a number above 0, at most {}", high));
}

}  // namespace photocoag
