// Role: the program; what the console's clients are told and may ask for: state, rows of the
// running spot, commands. Used by console_command, tests. Source: docs/console.md (messages,
// rules). Real time: none; of a running loop it has the ring's reading end and the wish to stop,
// nothing else. Threads: answer, tick, came, left and file by the server's thread; the rest by the
// owner's.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/console/foxglove.hpp"
#include "photocoag/console/server.hpp"
#include "photocoag/log/record.hpp"
#include "photocoag/log/ring.hpp"
#include "photocoag/safety/supervisor.hpp"

namespace photocoag {

struct DeskSettings {
  bool browser_starts = false;   ///< true: a simulated eye
  bool foxglove = false;         ///< true: cycles also for Foxglove clients
  double period = 1e-3;          ///< s
  std::function<void()> stop;    ///< the wish to stop: one atomic store
  std::function<void()> resume;  ///< takes it back; only when someone arms or starts
  std::string before;            ///< message "before" (describe.hpp); empty: not known yet
};

/// The spot that begins.
struct SpotBegin {
  int number = 0;
  std::size_t planned_cycles = 0;
};

/// The spot that has ended.
struct SpotEnd {
  SafetyState state = SafetyState::kDone;
  SafetyReason reason = SafetyReason::kNone;
  std::string message;           ///< "spot" (describe.hpp)
  std::filesystem::path folder;  ///< its run folder
};

class Desk {
 public:
  explicit Desk(DeskSettings settings);

  /// What the server asks.
  ServerHooks hooks(std::function<std::optional<WebFile>(std::string_view path)> page,
                    std::function<void(std::string_view line)> log);

  /// The loop's end of the ring.
  SpscRing<LogRecord>& live() noexcept { return ring_; }

  /// A self-test's outcome, before a spot or between two: STANDBY, or SAFE_STOP.
  void self_tested(const SelfTestReport& report, const SafetyLimits& limits);
  /// The device is tested when a spot starts: STANDBY.
  void stand_by();
  enum class Wish { kNone, kStart, kReset, kChoice };
  /// Waits until someone asks for a start or a reset, or chooses, at most so long.
  Wish wait(std::chrono::milliseconds patience);
  /// By the terminal: Enter. Starts from STANDBY or READY, resets after a spot.
  void enter();
  /// Right before a spot: whether what was started, or runs on, is still wanted. If so, nothing is
  /// armed until it has begun: a STOP that comes now is not taken back.
  bool commit();
  void begin(const SpotBegin& spot);
  /// Its loop has ended; what it leaves behind is being written.
  void over(SafetyState state, SafetyReason reason);
  void end(SpotEnd spot);

  SafetyState state() const;

  /// Another spot with another set-up: message "before".
  void set_before(std::string message);
  /// Of a session: what the operating tab may choose now, and which spots it may name. The answer
  /// is a Wish::kChoice. No choice starts anything.
  void offer(std::vector<std::string> choices, std::vector<std::string> spots = {});
  /// What was chosen: one of the offered words, with a spot after a space if one was named.
  std::string choice() const;
  /// The operating tab of a simulated eye wants spot after spot, and nothing has ended that: STOP,
  /// its leaving, or us.
  bool runs_on() const;
  void end_run_on();
  /// Nothing may be armed: the session is over.
  void rest();
  /// Message "session", to all and to whoever comes.
  void tell_session(std::string message);
  /// The run folders of all spots so far, in their order.
  void set_folders(std::vector<std::filesystem::path> folders);

 private:
  std::vector<std::string> came(int client);
  std::string answer(int client, std::string_view text);
  void left(int client);
  std::vector<std::string> tick();
  std::optional<WebFile> run_file(std::string_view path) const;
  std::string refusal(std::string_view command);
  std::string obey(int client, std::string_view command);
  std::string choose(std::string_view command);
  void nothing_starts(bool of_terminal);
  std::string live_message(std::string rows);
  std::string role_message() const;
  void set(SafetyState state, SafetyReason reason);

  DeskSettings settings_;
  FoxgloveFeed foxglove_;  // the server's
  SpscRing<LogRecord> ring_;
  std::vector<LogRecord> batch_;  // the server's
  LogRecord newest_;              // the server's
  std::int64_t dropped_ = 0;      // the server's
  std::int64_t next_cycle_ = 0;   // the server's
  std::int64_t overruns_ = 0;     // the server's
  int rows_of_ = 0;               // the server's: spot that newest_ belongs to

  mutable std::mutex mutex_;
  std::condition_variable wished_;
  SafetyState state_ = SafetyState::kSelfTest;
  SafetyReason reason_ = SafetyReason::kNone;
  Wish wish_ = Wish::kNone;
  enum class Starter { kNobody, kBrowser, kTerminal };
  Starter starter_ = Starter::kNobody;  // of the spot that is about to begin
  bool committed_ = false;
  bool run_on_ = false;
  std::vector<std::string> choices_, spots_;  // that are offered
  std::string choice_;
  std::string session_;  // last message of its kind
  bool session_told_ = true;
  SpotBegin spot_;
  int operator_ = 0;  // client; 0: none
  int clients_ = 0;
  std::string self_test_;                       // last message of its kind
  std::string last_spot_;                       // last message of its kind
  std::vector<std::string> pending_;            // for all, after the rows
  std::vector<std::filesystem::path> folders_;  // of the spots
};

}  // namespace photocoag
