// Role: the program; the commands about models: response, reduce, field, export, export-c,
// certify, boundaries, discretizations.
#pragma once

namespace CLI {
class App;
}

namespace photocoag {

/// Adds them to the program; each stores its exit code.
void add_model_commands(CLI::App& app, int& exit_code);

}  // namespace photocoag
