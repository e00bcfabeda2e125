// Role: the program; command lines of doctor, latency and convert.
#pragma once

namespace CLI {
class App;
}

namespace photocoag {

/// Adds the commands to the program; each stores its exit code.
void add_machine_commands(CLI::App& app, int& exit_code);

}  // namespace photocoag
