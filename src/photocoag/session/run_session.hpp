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

/// What an operator is asked before and after a spot, and what is told. Empty functions: the
/// session runs on, and tells nothing.
struct SessionOperator {
  enum class Before { kTreat, kSkip, kEnd };
  enum class After { kAccept, kRepeat, kEnd };
  std::function<Before(const SpotPlan&)> before;
  /// Once more, right before the spot's intent; false: it is not begun, and `before` asks again.
  std::function<bool()> still_wanted;
  std::function<After(const AttemptOutcome&)> after;
  /// Before `before`: what the spot's controller will be told, and its model.
  std::function<void(const SpotPlan&, const Config& told, const ReducedModel&)> prepared;
  /// A spot begins (attempt 1, 2, …).
  std::function<void(const SpotPlan&, const Config&, int attempt)> begins;
  /// Its loop has ended; its files are still to be written.
  std::function<void(const Config&, const Treatment&, const std::filesystem::path& folder)> treated;
  /// A spot is over, with or without the operator.
  std::function<void(const AttemptOutcome&)> over;
  /// The journal as it is at first and after every change.
  std::function<void(const SessionJournal&)> changed;
  Onlooker onlooker;
};

struct SessionOptions {
  std::filesystem::path out;        ///< new, empty, or the folder of this session
  std::vector<std::string> repeat;  ///< spots that are treated again, whatever became of them
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
  kLimit,   ///< the next spot might exceed a limit of the session
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

/// `stop`: ends the running spot at 0 W, and the session. `progress` counts the running spot's
/// cycles. Throws Error before the first spot only.
SessionResult run_session(const Session& session, const SessionOptions& options,
                          const std::atomic<bool>& stop, std::atomic<std::size_t>& progress);

}  // namespace photocoag
