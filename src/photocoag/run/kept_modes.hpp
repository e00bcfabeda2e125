// Role: setup; caches eigenpairs of the full-order model, most of the start-up time of `simulate`
// and `treat`, in the model cache's folder. Used by run. A file's name is a hash of the matrix and
// of all sources; its content has a checksum and is checked against the matrix.
#pragma once

#include <string>

#include "photocoag/fom/diagonalize.hpp"

namespace photocoag {

/// Files kept: the most recently used.
inline constexpr std::size_t kMostKeptModes = 8;

/// Reads and writes `folder`; without a folder or a valid file it computes. Bit-identical either
/// way.
Diagonalize kept_modes(std::string folder);

}  // namespace photocoag
