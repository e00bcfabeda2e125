#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "command.hpp"
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
                           .accepted = "a whole build (./photocoag build) or installation: this "
                                       "command is there"});
  }
  execv(program.c_str(), argv);
  throw Error(ErrorParts{.where = program.string(),
                         .problem = "cannot be run: " + std::generic_category().message(errno)});
}

// All further arguments, including --help, belong to the other program.
void hand_over(CommandLine& command, int&) {
  command.take_everything();
  command.callback([] { become_full_program(program_arguments()); });
}

// Written from the commands' own files (cmake/command_names.cmake).
const Command kHandedOver[] = {
#include "command_names.inc"
};

}  // namespace

}  // namespace photocoag
