// Role: setup; eigenpairs of the full-order model in the folder of cached models: most of what
// `simulate` and `treat` compute before they start. Used by run. The file's name is a hash of the
// matrix and of all sources; what is read has a checksum and is held against the matrix.
#pragma once

#include <string>

#include "photocoag/fom/diagonalize.hpp"

namespace photocoag {

/// Of the files only so many stay, those used last.
inline constexpr std::size_t kMostKeptModes = 8;

/// Reads and writes `folder`; without one, or with a file that is no good, computes. The same bits.
Diagonalize kept_modes(std::string folder);

}  // namespace photocoag
