// Role: the program; a ZIP archive (minizip). Used by export-fmu.
#pragma once

#include <string>
#include <vector>

#include "photocoag/fmu/package.hpp"

namespace photocoag {

/// The archive's bytes: deflated, all files with the date 1 January 1980, so that the same files
/// give the same bytes. Throws Error.
std::string zip_archive(const std::vector<FmuFile>& files);

}  // namespace photocoag
