// Role: the program; the configuration as a command uses it.
#pragma once

#include <string>
#include <vector>

#include "photocoag/config/usage.hpp"

namespace photocoag {

/// The configuration of --config and --set for a use of it; what has no effect there is said on
/// standard error. Throws Error.
Config configured(Use use, const std::string& file, const std::vector<std::string>& set);

}  // namespace photocoag
