// Role: the program; its commands. Each is one file with name, options and action, registered by
// its one `Command` object. main.cpp groups them for --help.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "command_line.hpp"

namespace photocoag {

inline constexpr int kExitBadInput = 2;

class Command {
 public:
  /// Gives `command` its options and examples, and a callback that stores the exit code.
  using Configure = std::function<void(CommandLine& command, int& exit_code)>;

  Command(const char* name, const char* description, Configure configure);
  /// `describe` binds the command line to `options` and gives examples. `run` returns the exit
  /// code: 0 good, 1 a check failed or the treatment was stopped. Bad input throws Error (exit code
  /// 2).
  template <typename Options>
  Command(const char* name, const char* description, int (*run)(const Options&),
          std::type_identity_t<void (*)(CommandLine& command, Options& options)> describe)
      : Command(name, description, [run, describe](CommandLine& command, int& exit_code) {
          const auto options = std::make_shared<Options>();
          describe(command, *options);
          command.callback([run, options, &exit_code] { exit_code = run(*options); });
        }) {}
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  std::string_view name() const noexcept { return name_; }
  void add_to(CLI::App& app, const char* group, int& exit_code) const;

 private:
  const char* name_;
  const char* description_;
  Configure configure_;
};

/// The program's own arguments, ended by null.
char** program_arguments() noexcept;

/// A group of commands in --help.
struct CommandGroup {
  const char* what_for;
  std::vector<std::string_view> commands;
};

/// Texts for --help and --version.
struct ProgramWords {
  std::string name;
  std::string description;
  std::string footer;
  std::function<std::string()> version;
};

/// Reads the arguments and runs the command they name; returns its exit code, 2 for bad usage.
/// Commands are listed in the order of the groups, ungrouped ones last.
int run_program(const ProgramWords& words, const std::vector<CommandGroup>& groups, int argc,
                char** argv);

}  // namespace photocoag
