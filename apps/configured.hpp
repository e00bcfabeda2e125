// Role: the program; the configuration of a command.
#pragma once

#include <string>
#include <vector>

#include "photocoag/config/usage.hpp"

namespace photocoag {

/// The configuration of --config and --set; keys without effect in `use` are reported on standard
/// error. Throws Error.
Config configured(Use use, const std::string& file, const std::vector<std::string>& set);

}  // namespace photocoag
