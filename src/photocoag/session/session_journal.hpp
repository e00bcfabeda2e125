// Role: the program; what a session has done, on disk before it is done: a spot's intent is there
// before its first light, its outcome after its last file. Used by session. Format:
// docs/sessions.md. Append-only lines, each with its checksum; a line cut short by a crash is
// dropped. Real-time promise: none; every entry waits for the disk. Threads: one owner.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/core/descriptor.hpp"
#include "photocoag/session/attempt_outcome.hpp"
#include "photocoag/session/session_file.hpp"

namespace photocoag {

/// One spot as the journal knows it.
struct SpotHistory {
  std::vector<AttemptOutcome> attempts;  ///< an attempt without an outcome: kMayHaveEmitted
  bool skipped = false;                  ///< by the operator, after the last attempt
  bool wanted = true;                    ///< to be treated: not begun, or asked for again

  SpotEnding ending() const noexcept;
};

class SessionJournal {
 public:
  /// Opens or makes `file`, locks it, and reads what is there. Throws Error if another process has
  /// it, if it belongs to another session, or if a line before the last one is damaged.
  SessionJournal(const std::filesystem::path& file, const Session& session);

  const std::vector<SpotHistory>& spots() const noexcept { return spots_; }
  /// All attempts in their order.
  const std::vector<AttemptOutcome>& attempts() const noexcept { return attempts_; }
  /// Whether the journal was there before.
  bool continued() const noexcept { return continued_; }
  /// s, from the first intent (or now, if there is none) to now, by the system's clock.
  double elapsed() const;
  /// s, Unix time of the first intent; 0: there is none.
  double begun() const noexcept { return begun_; }
  /// J, of all attempts; those without an outcome count with all that they could have emitted.
  double energy() const noexcept;

  /// The spot is about to be treated. Returns when the disk has it.
  void intend(std::size_t spot, const AttemptOutcome& begun);
  /// It is over; its files are there.
  void finish(std::size_t spot, const AttemptOutcome& outcome);
  /// The operator leaves it out.
  void skip(std::size_t spot);
  /// The operator wants it again.
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
