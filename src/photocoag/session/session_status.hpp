// Role: the program; state of a running session for the console's clients: message "session". Used
// by `console --session`. Format: docs/console.md. Units: in the names. Real-time promise: none.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/session/session_file.hpp"
#include "photocoag/session/session_journal.hpp"

namespace photocoag {

/// Where a session is between two of the operator's decisions.
enum class SessionPhase {
  kPreparing,  ///< models, files
  kBefore,     ///< waits for the spot's start
  kStarting,   ///< started; the pause between two spots, the intent
  kTreating,
  kWriting,  ///< the loop has ended
  kAfter,    ///< waits for the outcome to be accepted
  kEnded,
};
std::string_view word_of(SessionPhase phase) noexcept;

/// Snapshot of the journal.
struct SessionState {
  std::vector<SpotHistory> spots;
  std::vector<AttemptOutcome> attempts;  ///< in their order: number k is the console's spot k + 1
  double energy = 0.0;                   ///< J
  double begun = 0.0;                    ///< s, Unix time of the first intent; 0: none
};
SessionState state_of(const SessionJournal& journal);

/// `spot`: current spot; may be empty. `why`: why the session has ended; may be empty.
std::string session_message(const Session& session, const SessionState& state, SessionPhase phase,
                            const std::string& spot, const std::string& why,
                            const std::filesystem::path& folder);

}  // namespace photocoag
