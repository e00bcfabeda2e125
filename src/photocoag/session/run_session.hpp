// Role: the program; treats the spots of a session one after the other, each by the pipeline of
// `treat` in a run folder of its own, and continues one that was interrupted. Used by
// `photocoag session`, tests. Source: docs/sessions.md. Real-time promise: treat's, while a spot is
// treated. Threads: one owner.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/session/session_file.hpp"
#include "photocoag/session/session_journal.hpp"

namespace photocoag {

/// Questions to and notifications of the operator. Empty functions: the session continues without.
struct SessionOperator {
  enum class Before { kTreat, kSkip, kEnd };
  enum class After { kAccept, kRepeat, kEnd };
  std::function<Before(const SpotPlan&)> before;
  /// Asked again right before the spot's intent is recorded; false: the spot is not begun and
  /// `before` asks again.
  std::function<bool()> still_wanted;
  std::function<After(const AttemptOutcome&)> after;
  /// Called before `before` with the configuration and model of the spot's controller.
  std::function<void(const SpotPlan&, const Config& controlled, const ReducedModel&)> prepared;
  /// A spot begins (attempt 1, 2, …).
  std::function<void(const SpotPlan&, const Config&, int attempt)> begins;
  /// Its loop has ended; its files are not yet written.
  std::function<void(const Config&, const Treatment&, const std::filesystem::path& folder)> treated;
  /// A spot is finished, accepted by the operator or not.
  std::function<void(const AttemptOutcome&)> over;
  /// Called initially and after every change of the journal.
  std::function<void(const SessionJournal&)> changed;
  TreatmentMonitor monitor;
};

struct SessionOptions {
  std::filesystem::path out;        ///< new, empty, or the folder of this session
  std::vector<std::string> repeat;  ///< spots to treat again, whatever their outcome
  bool use_cache = true;
  SessionOperator ask;
};

/// Why there is no next spot.
enum class SessionEnd {
  kComplete,     ///< every spot has been treated or skipped, or waits for --repeat
  kInterrupted,  ///< Ctrl-C
  kOperator,     ///< the operator has ended it
  kStopped,      ///< the supervisor has stopped a spot
  kDeviceFault,
  kLimit,   ///< the next spot could exceed a limit of the session
  kFailed,  ///< a spot's files could not be written, or it could not begin
};

struct SessionResult {
  std::vector<SpotHistory> spots;        ///< by number
  std::vector<AttemptOutcome> attempts;  ///< in their order
  SessionEnd end = SessionEnd::kComplete;
  std::string why;         ///< in words, where it is not complete
  bool continued = false;  ///< there was a journal
  double energy = 0.0;     ///< J
};

/// `stop` ends the current spot at 0 W and the session. `progress` counts the current spot's
/// cycles. Throws Error only before the first spot.
SessionResult run_session(const Session& session, const SessionOptions& options,
                          const std::atomic<bool>& stop, std::atomic<std::size_t>& progress);

}  // namespace photocoag
