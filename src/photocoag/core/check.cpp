#include "photocoag/core/check.hpp"

#include <fmt/format.h>

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

}  // namespace photocoag
