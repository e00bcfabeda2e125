// Role: the program; how `session` and `console --session` begin and end.
#pragma once

#include <filesystem>

#include "photocoag/session/run_session.hpp"
#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// Prints the program's notice and keys of the session's file without effect. Throws Error if `out`
/// is empty, the folder in which an interrupted session continues.
void begin_session(const std::filesystem::path& out, const Session& session);

/// Writes the session's own files and prints its result; returns the exit code (docs/sessions.md).
int finish_session(const std::filesystem::path& out, const Session& session,
                   const SessionResult& result);

}  // namespace photocoag
