// Role: the program; folders of studies and of their results.
#pragma once

#include <filesystem>
#include <string>

#include "photocoag/run/claimed_folder.hpp"

namespace photocoag {

/// The shipped studies: beside an installed program, else in the source tree around its build tree.
std::filesystem::path shipped_studies();

/// The folder asked for, or a new one below runs/.
ClaimedFolder output_folder(const std::string& out, const std::string& name);

}  // namespace photocoag
