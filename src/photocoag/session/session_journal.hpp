// Role: the program; write-ahead journal of a session: a spot's intent is on disk before its first
// light, its outcome after its last file. Used by session. Format: docs/sessions.md. Append-only
// lines, each with its checksum; a line truncated by a crash is dropped. Real-time promise: none;
// every entry waits for the disk. Threads: one owner.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/core/descriptor.hpp"
#include "photocoag/session/attempt_outcome.hpp"
#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// History of one spot.
struct SpotHistory {
  std::vector<AttemptOutcome> attempts;  ///< an attempt without an outcome: kMayHaveEmitted
  bool skipped = false;                  ///< by the operator, after the last attempt
  bool wanted = true;                    ///< to be treated: not begun, or asked for again

  SpotEnding ending() const noexcept;
};

class SessionJournal {
 public:
  /// Opens or creates `file`, locks it and reads it. Throws Error if another process has it, if it
  /// belongs to another session, or if a line before the last one is damaged.
  SessionJournal(const std::filesystem::path& file, const Session& session);

  const std::vector<SpotHistory>& spots() const noexcept { return spots_; }
  /// All attempts in their order.
  const std::vector<AttemptOutcome>& attempts() const noexcept { return attempts_; }
  /// True if the journal already existed.
  bool continued() const noexcept { return continued_; }
  /// s since the first intent (0 if there is none), by the system clock.
  double elapsed() const;
  /// s, Unix time of the first intent; 0: there is none.
  double begun() const noexcept { return begun_; }
  /// J, of all attempts; those without an outcome count with their upper bound.
  double energy() const noexcept;

  /// The spot is about to be treated. Returns once this is on disk.
  void intend(std::size_t spot, const AttemptOutcome& begun);
  /// The spot is finished and its files are written.
  void finish(std::size_t spot, const AttemptOutcome& outcome);
  /// Skipped by the operator.
  void skip(std::size_t spot);
  /// To be repeated by the operator's request.
  void repeat(std::size_t spot);

 private:
  void read(const Session& session);
  void apply(const std::string& line, const Session& session);
  void append(const std::string& line);

  std::string name_;
  Descriptor file_;
  bool continued_ = false;
  double begun_ = 0.0;  // s, system clock, of the first intent; 0: none
  std::vector<std::string> names_;
  std::vector<SpotHistory> spots_;
  std::vector<AttemptOutcome> attempts_;
};

}  // namespace photocoag
