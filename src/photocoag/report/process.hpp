// Role: offline; runs another program without a shell. Used by plot.cpp.
// Real-time promise: none (spawns, waits, allocates). Threads: may be called from any thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

/// What a program that has ended left behind.
struct ProgramResult {
  bool found = true;        ///< false: no such program (the other fields are then empty)
  int exit_code = 0;        ///< its exit code, or 128 + the number of the signal that ended it
  std::string output = {};  ///< all of its standard output
  std::string errors = {};  ///< all of its standard error
};

/// Runs arguments[0] (searched in PATH) with the other arguments, gives it `input`, waits for it.
///
/// No shell takes part, so nothing in the arguments is interpreted. The child sees only PATH and
/// LC_ALL=C.UTF-8 of the environment (same output everywhere) and has its own process group: Ctrl-C
/// at the terminal does not end it half-way.
/// Precondition: `arguments` is not empty. Throws Error if the system refuses to start a program.
ProgramResult run_program(const std::vector<std::string>& arguments, std::string_view input);

}  // namespace photocoag
