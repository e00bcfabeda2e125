// Role: the program; the command `export-fmu`.
#pragma once

namespace CLI {
class App;
}

namespace photocoag {

/// Adds it to the program; it stores its exit code.
void add_export_fmu(CLI::App& app, int& exit_code);

}  // namespace photocoag
