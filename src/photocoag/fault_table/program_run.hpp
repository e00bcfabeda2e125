// Role: safety tests; runs the program itself. Used by program_rows, web_rows.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "photocoag/fault_table/process_trials.hpp"

namespace photocoag {

using Arguments = std::vector<std::string>;

/// How a run of the program is set up besides its arguments.
struct RunSetup {
  Arguments environment;              // NAME=value, added
  bool unprivileged = false;          // neither priority nor locked memory
  std::function<void(pid_t)> during;  // called once the child runs
};

struct ProgramRun {
  int code = -1;  // exit code; 256 + signal
  std::string said;
};

/// Runs in `folder` until it has ended; its output goes to said.txt there. Throws Error.
ProgramRun run_program(const ProcessFaultOptions& options, const std::filesystem::path& folder,
                       Arguments arguments, const RunSetup& setup = {});

/// The last line of its output.
std::string last_line(const std::string& text);

}  // namespace photocoag
