// Role: the program; the command `session`. Returns the exit code.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace photocoag {

struct SessionCommandOptions {
  std::string file;
  std::string out;                  ///< session folder
  std::vector<std::string> repeat;  ///< spots to treat again
  bool ask = false;
  bool json = false;      ///< the outcome as JSON on standard output
  std::size_t study = 0;  ///< instead: so many simulated sessions with and without learning
  bool no_cache = false;
};

int session_command(const SessionCommandOptions& options);

/// Adds it to the program; it stores its exit code.
void add_session(CLI::App& app, int& exit_code);

}  // namespace photocoag
