// Role: offline; the page of a session. Used by `photocoag session`. One self-contained file beside
// the spots' run folders; the same spots give the same bytes. Units: beside every number.
// Real-time promise: none.
#pragma once

#include <string>

#include "photocoag/session/run_session.hpp"
#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// Map, distributions, drift over the session, all attempts.
std::string session_page(const Session& session, const SessionResult& result);

}  // namespace photocoag
