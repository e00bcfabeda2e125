// Role: the program; the end of `session` and of `console --session`.
#pragma once

#include <filesystem>

#include "photocoag/session/run_session.hpp"
#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// Writes the session's own files and says what it came to; the exit code (docs/sessions.md).
int finish_session(const std::filesystem::path& out, const Session& session,
                   const SessionResult& result);

}  // namespace photocoag
