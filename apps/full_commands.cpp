#include <CLI/CLI.hpp>

#include "completion.hpp"
#include "console_command.hpp"
#include "convert_command.hpp"
#include "full_program.hpp"
#include "session_command.hpp"
#include "study_commands.hpp"

namespace photocoag {

void add_full_commands(CLI::App& app, int& exit_code, char**) {
  add_campaign(app, exit_code);
  add_session(app, exit_code);
  add_console_command(app, exit_code);
  add_convert(app, exit_code);
  add_completion(app, exit_code);
}

}  // namespace photocoag
