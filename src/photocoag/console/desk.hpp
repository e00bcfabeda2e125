// Role: the program; the console's state and commands for its clients: state, rows of the running
// spot, commands. Used by apps, tests. Source: docs/console.md. Real time: none; its only links to
// a running loop are the ring's reading end and the stop request. Threads: answer, tick, came, left
// and file by the server's thread; the rest by the owner's.
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
  std::function<void()> stop;    ///< requests a stop: one atomic store
  std::function<void()> resume;  ///< withdraws it; only on arming or starting
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

  /// Callbacks for the server.
  ServerHooks hooks(std::function<std::optional<WebFile>(std::string_view path)> page,
                    std::function<void(std::string_view line)> log);

  /// The ring that the loop writes to.
  SpscRing<LogRecord>& live() noexcept { return ring_; }

  /// A self-test's outcome, before a spot or between two: STANDBY, or SAFE_STOP.
  void self_tested(const SelfTestReport& report, const SafetyLimits& limits);
  /// STANDBY without a self-test: the device is tested when a spot starts.
  void stand_by();
  enum class Wish { kNone, kStart, kReset, kChoice };
  /// Waits at most `patience` for a start, a reset or a choice.
  Wish wait(std::chrono::milliseconds patience);
  /// Enter at the terminal: starts from STANDBY or READY, resets after a spot.
  void enter();
  /// Right before a spot: true if the start, or running on, is still wanted. From then until
  /// begin() nothing can be armed, so that a STOP in between is not withdrawn.
  bool commit();
  void begin(const SpotBegin& spot);
  /// Its loop has ended; its files are being written.
  void over(SafetyState state, SafetyReason reason);
  void end(SpotEnd spot);

  SafetyState state() const;

  /// Message "before" of the next spot.
  void set_before(std::string message);
  /// For a session: the choices of the operating tab, and the spots it may name. The result is a
  /// Wish::kChoice. No choice starts a spot.
  void offer(std::vector<std::string> choices, std::vector<std::string> spots = {});
  /// The choice: one of the offered words, followed by a space and a spot if one was named.
  std::string choice() const;
  /// True while the operating tab of a simulated eye has asked for spot after spot, and neither
  /// STOP, its leaving nor end_run_on() has ended that.
  bool runs_on() const;
  void end_run_on();
  /// The session is over: nothing can be armed any more.
  void rest();
  /// Message "session", to all present and later clients.
  void tell_session(std::string message);
  /// The run folders of all spots so far, in order.
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
