// Role: the program; how `session` and `console --session` begin and end.
#pragma once

#include <filesystem>

#include "photocoag/session/run_session.hpp"
#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// Says which program it is and what of the session's file has no effect. Throws Error if there is
/// no `out`, the folder in which a session that is interrupted continues.
void begin_session(const std::filesystem::path& out, const Session& session);

/// Writes the session's own files and says what it came to; the exit code (docs/sessions.md).
int finish_session(const std::filesystem::path& out, const Session& session,
                   const SessionResult& result);

}  // namespace photocoag
