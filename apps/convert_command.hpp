// Role: the program; the command `convert`.
#pragma once

namespace CLI {
class App;
}

namespace photocoag {

/// Adds it to the program; it stores its exit code.
void add_convert(CLI::App& app, int& exit_code);

}  // namespace photocoag
