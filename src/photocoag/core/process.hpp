// Role: offline; runs another program without a shell and with a time limit. Used by apps,
// realtime_check, fault_table.
// Real-time promise: none (spawns, waits, allocates). Threads: may be called from any thread.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

/// Result of a program that has ended.
struct ProgramResult {
  bool found = true;        ///< false: no such program (the other fields are then empty)
  int exit_code = 0;        ///< its exit code, or 128 + the number of the signal that ended it
  std::string output = {};  ///< all of its standard output
  std::string errors = {};  ///< all of its standard error
};

struct ProgramOptions {
  std::string_view input = {};     ///< for its standard input
  double patience = 120.0;         ///< s; the program is killed if it has not ended by then
  bool whole_environment = false;  ///< false: only PATH and LC_ALL=C.UTF-8, same output everywhere
};

/// Runs arguments[0] (searched in PATH) with the other arguments and waits for it.
///
/// There is no shell, so nothing in the arguments is interpreted. The child has its own process
/// group: Ctrl-C at the terminal does not end it half-way.
/// Precondition: `arguments` is not empty. Throws Error if the system refuses to start a program,
/// and on a timeout or a stop request (stop_signal.hpp): the process group is then killed.
ProgramResult run_program(const std::vector<std::string>& arguments,
                          const ProgramOptions& options = {});

/// Waits for a child. Returns waitpid's status, or nothing after `patience` seconds or on a stop
/// request: the child is then killed.
std::optional<int> wait_for_child(pid_t child, double patience);

}  // namespace photocoag
