// Role: the program exists twice. `photocoag` has what a first treatment needs and links none of
// HDF5, matio, MPI and libwebsockets: it builds in a fraction of the time and starts in 3 ms.
// `photocoag-full` has all commands; `photocoag` execs it for those it does not have.
#pragma once

#include <filesystem>
#include <initializer_list>

namespace photocoag {

/// The first of `places` that exists relative to the program's folder or one of up to `above`
/// parent folders; empty if none does.
std::filesystem::path find_from_program(std::initializer_list<const char*> places, int above);

}  // namespace photocoag
