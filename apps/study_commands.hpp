// Role: the program; commands for many runs at once: reproduce. Each returns the exit code.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace photocoag {

struct ReproduceCommandOptions {
  std::string out;      ///< folder, new or empty; empty: a new one below runs/
  std::string studies;  ///< folder; empty: the shipped one
  bool quick = false;
  bool no_cache = false;
};

int reproduce_command(const ReproduceCommandOptions& options);

/// Adds the commands of this file to the program; each stores its exit code.
void add_study_commands(CLI::App& app, int& exit_code);

}  // namespace photocoag
