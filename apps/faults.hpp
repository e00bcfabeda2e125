// Role: the program; declarations shared by the two files of `faults`.
#pragma once

#include <string>

#include "options.hpp"

namespace photocoag {

struct FaultsOptions {
  std::string row;                  ///< one id; empty: all
  bool without_supervisor = false;  ///< to see that every row needs it
  int allocation_step = 97;         ///< row X3: every n-th allocation fails
  int healthy = 0;                  ///< treatments without faults, to count false stops
  int kills = 0;                    ///< controllers to kill beside an eye in another process
  int stops = 0;                    ///< controllers to stop for 20 ms
};

/// Runs --kills and --stops. Returns the exit code.
int kill_trials(const FaultsOptions& options);

}  // namespace photocoag
