// Role: offline; runs another program without a shell, for so long at most. Used by plot.cpp,
// realtime_check, fault_table, the benchmarks.
// Real-time promise: none (spawns, waits, allocates). Threads: may be called from any thread.
#pragma once

#include <sys/types.h>

#include <optional>
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

struct ProgramOptions {
  std::string_view input = {};     ///< for its standard input
  double patience = 120.0;         ///< s; it is killed if it has not ended by then
  bool whole_environment = false;  ///< false: only PATH and LC_ALL=C.UTF-8, same output everywhere
};

/// Runs arguments[0] (searched in PATH) with the other arguments and waits for it.
///
/// No shell takes part, so nothing in the arguments is interpreted. The child has its own process
/// group: Ctrl-C at the terminal does not end it half-way.
/// Precondition: `arguments` is not empty. Throws Error if the system refuses to start a program,
/// and if its time is over or a stop is asked for meanwhile (stop_signal.hpp): it and what it has
/// started are then killed.
ProgramResult run_program(const std::vector<std::string>& arguments,
                          const ProgramOptions& options = {});

/// Waits for a child. Returns waitpid's status, or nothing if it has not ended after `patience`
/// seconds or a stop is asked for meanwhile: it is then killed.
std::optional<int> wait_for_child(pid_t child, double patience);

}  // namespace photocoag
