#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <system_error>

#include "full_program.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

[[noreturn]] void become_full_program(char** argv) {
  const std::filesystem::path program =
      find_from_program({"photocoag-full", "libexec/photocoag/photocoag-full"}, 1);
  if (program.empty()) {
    throw Error(ErrorParts{.where = "photocoag-full",
                           .problem = "not beside this program nor in ../libexec/photocoag",
                           .accepted = "a whole build or installation: this command is there"});
  }
  execv(program.c_str(), argv);
  throw Error(ErrorParts{.where = program.string(),
                         .problem = "cannot be run: " + std::generic_category().message(errno)});
}

}  // namespace

void add_full_commands(CLI::App& app, int&, char** argv) {
  for (const CommandName& command : {kCampaign, kSession, kConsole, kConvert, kCompletion}) {
    CLI::App* added = app.add_subcommand(command.name, command.description);
    // Whatever follows, --help too, is the other program's.
    added->set_help_flag();
    added->prefix_command();
    added->callback([argv] { become_full_program(argv); });
  }
}

}  // namespace photocoag
