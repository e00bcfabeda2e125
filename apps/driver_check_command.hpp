// Role: the program; the command `driver-check`.
#pragma once

namespace CLI {
class App;
}

namespace photocoag {

/// Adds it to the program; it stores its exit code.
void add_driver_check(CLI::App& app, int& exit_code);

}  // namespace photocoag
