// Role: the program; a session's own files beside its spots' run folders: session.json,
// summary.json, session.h5. Used by `photocoag session`. Format: docs/sessions.md. Units: in the
// names. The same session in virtual time gives the same bytes. Real-time promise: none.
#pragma once

#include <filesystem>
#include <string>

#include "photocoag/session/run_session.hpp"
#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// Totals of a session.
struct SessionTotals {
  std::size_t spots = 0;    ///< planned
  std::size_t treated = 0;  ///< went to their end, of the planned ones
  std::size_t over_limit = 0;
  std::size_t stopped = 0;
  std::size_t uncertain = 0;  ///< may have emitted
  std::size_t attempts = 0;
  double energy_mJ = 0.0;
  double absorption_mean = kNotKnown;  ///< of the spots that went to their end
  double absorption_deviation = kNotKnown;
};
SessionTotals totals_of(const SessionResult& result);

/// The word for why the session ended.
std::string_view word_of(SessionEnd end) noexcept;

/// session.json: totals, limits, every spot and every attempt. summary.json: the totals alone.
std::string session_json(const Session& session, const SessionResult& result);
std::string session_summary_json(const Session& session, const SessionResult& result);

/// session.h5: one row per attempt. Throws Error.
void write_session_table(const std::filesystem::path& file, const Session& session,
                         const SessionResult& result);

}  // namespace photocoag
