// Role: the program; it exists twice. `photocoag` has what a first treatment needs and links none
// of HDF5, matio, MPI and libwebsockets: it is built in a fraction of the time and starts in 3 ms.
// `photocoag-full` has all commands; `photocoag` becomes it (exec) for those that it has not.
#pragma once

#include <filesystem>
#include <initializer_list>

namespace photocoag {

/// The first of `places` that exists, seen from the program's folder and from up to `above` folders
/// above it; empty: none does.
std::filesystem::path find_from_program(std::initializer_list<const char*> places, int above);

}  // namespace photocoag
