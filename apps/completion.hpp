// Role: the program; what shells complete and the manual page, from the commands as they are
// declared.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>

namespace photocoag {

/// Adds `completion`, which reads all commands of `app` when it is called.
void add_completion(CLI::App& app, int& exit_code);

/// For "bash", "zsh", "fish": a script to be sourced; for "man": the manual page (roff).
std::string completion(const CLI::App& app, std::string_view kind);

}  // namespace photocoag
