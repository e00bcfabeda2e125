// Role: the program; `console --session`: a session whose operator sits at the page. Returns the
// exit code of `session`.
#pragma once

#include "console_command.hpp"

namespace photocoag {

int console_session(const ConsoleOptions& options);

}  // namespace photocoag
