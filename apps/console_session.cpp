// `photocoag console --session FILE`: run_session with the page as its operator.
#include "console_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "console.hpp"
#include "console_parts.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/realtime_check/doctor.hpp"
#include "photocoag/run/supervision.hpp"
#include "photocoag/session/run_session.hpp"
#include "photocoag/session/session_status.hpp"
#include "session_ends.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
using Before = SessionOperator::Before;
using After = SessionOperator::After;

double shortest_period(const Session& session) {
  double period = session.configs.front().control.period;
  for (const Config& config : session.configs) period = std::min(period, config.control.period);
  return period;
}

/// A session between its desk and its folder. All of it by the program's main thread.
class SessionBench {
 public:
  SessionBench(const Session& session, const ConsoleOptions& options, const ConsoleDevice& device,
               Desk& desk, const ConsoleServer& server)
      : session_(session), out_(options.out), device_(device), desk_(desk), server_(server) {
    request_ = {.out = options.out, .repeat = {}, .use_cache = !options.no_cache, .ask = asks()};
  }

  /// Runs the session, again and again while the operator wants it to go on.
  int serve() {
    int code = 1;
    do {
      again_ = false;
      std::atomic<std::size_t> progress{0};
      request_.repeat = std::exchange(repeat_, {});
      const SessionResult result = run_session(session_, request_, stop_requested(), progress);
      desk_.end_run_on();
      if (again_) continue;
      tell(SessionPhase::kEnded, "", why_of(result));
      code = finish_session(out_, session_, result);
    } while (again_ || goes_on());
    if (!server_.alive()) say("photocoag: the server has ended; no further spot starts\n");
    say("console   the server refused {} requests\n", server_.refusals().total());
    return server_.alive() ? code : std::max(code, 1);
  }

 private:
  bool over() const { return stop_requests() > 0 || !server_.alive(); }

  static std::string why_of(const SessionResult& result) {
    return result.end == SessionEnd::kComplete
               ? "Every spot has been treated or skipped, or waits to be repeated."
               : result.why;
  }

  SessionOperator asks() {
    SessionOperator asks;
    asks.before = [this](const SpotPlan& plan) { return before(plan); };
    asks.still_wanted = [this] { return server_.alive() && desk_.commit(); };
    asks.after = [this](const AttemptOutcome& outcome) { return after(outcome); };
    asks.prepared = [this](const SpotPlan&, const Config& controlled, const ReducedModel& model) {
      controlled_ = controlled;
      desk_.set_before(before_message(controlled, model, device_, findings_));
    };
    asks.begins = [this](const SpotPlan& plan, const Config& config, int attempt) {
      begins(plan, config, attempt);
    };
    asks.treated = [this](const Config& config, const Treatment& treatment,
                          const fs::path& folder) { treated(config, treatment, folder); };
    asks.over = [this](const AttemptOutcome& outcome) { over(outcome); };
    asks.changed = [this](const SessionJournal& journal) { changed(journal); };
    asks.monitor = {
        .live = &desk_.live(),
        .self_tested = [this](const SelfTestReport& report, const SafetyLimits& limits) {
          desk_.self_tested(report, limits);
        }};
    return asks;
  }

  void tell(SessionPhase phase, const std::string& spot, const std::string& why = {}) {
    phase_ = phase;
    spot_ = spot;
    desk_.tell_session(session_message(session_, state_, phase, spot, why, out_));
  }

  void changed(const SessionJournal& journal) {
    state_ = state_of(journal);
    std::vector<fs::path> folders;
    for (const AttemptOutcome& attempt : state_.attempts) folders.push_back(out_ / attempt.folder);
    desk_.set_folders(std::move(folders));
    tell(phase_, spot_);
  }

  // Spots that were begun or skipped and may be repeated.
  std::vector<std::string> visited() const {
    std::vector<std::string> names;
    for (std::size_t k = 0; k < state_.spots.size(); ++k) {
      if (!state_.spots[k].wanted) names.push_back(session_.spots[k].name);
    }
    return names;
  }

  void offer_with_repeat(std::vector<std::string> choices) {
    std::vector<std::string> names = visited();
    if (!names.empty()) choices.emplace_back("repeat");
    desk_.offer(std::move(choices), std::move(names));
  }

  void test() {
    if (!device_.self_test_first || !controlled_ || !controlled_->safety.supervised) {
      return desk_.stand_by();
    }
    desk_.self_tested(self_test_eye(*controlled_, true), safety_limits(*controlled_));
  }

  // A choice of "repeat A1" goes into the next run of the session.
  bool repeats(const std::string& choice) {
    constexpr std::string_view kRepeat = "repeat ";
    if (!choice.starts_with(kRepeat)) return false;
    repeat_.push_back(choice.substr(kRepeat.size()));
    return true;
  }

  Before before(const SpotPlan& plan) {
    tell(SessionPhase::kBefore, plan.name);
    test();
    offer_with_repeat({"skip", "end"});
    const Before wanted = ask_before();
    desk_.offer({});
    controlled_.reset();
    if (wanted == Before::kTreat) tell(SessionPhase::kStarting, plan.name);
    return wanted;
  }

  Before ask_before() {
    while (!over() && !stop_requested()) {
      if (desk_.runs_on() && desk_.state() == SafetyState::kStandby) return Before::kTreat;
      if (terminal_.enter()) desk_.enter();
      switch (desk_.wait(kConsolePoll)) {
        case Desk::Wish::kStart:
          return Before::kTreat;
        case Desk::Wish::kReset:
          test();
          break;
        case Desk::Wish::kChoice:
          if (desk_.choice() == "skip") return Before::kSkip;
          again_ = repeats(desk_.choice());
          return Before::kEnd;
        case Desk::Wish::kNone:
          break;
      }
    }
    return Before::kEnd;
  }

  void begins(const SpotPlan& plan, const Config& config, int attempt) {
    const int number = static_cast<int>(state_.attempts.size()) + 1;
    failed_ = true;  // until there is a treatment
    desk_.begin({.number = number, .planned_cycles = config.cycles()});
    say("spot {:<6} {}{:g} K\n", plan.name, attempt > 1 ? fmt::format("attempt {}, ", attempt) : "",
        config.control.peak_reference);
    tell(SessionPhase::kTreating, plan.name);
  }

  void treated(const Config& config, const Treatment& treatment, const fs::path& folder) {
    failed_ = false;
    end_ = {.state = treatment.outcome.safety.state,
            .reason = treatment.outcome.safety.reason,
            .message = {},
            .folder = folder};
    // Without a supervisor the state is not set.
    if (end_.state == SafetyState::kTreating) end_.state = SafetyState::kDone;
    desk_.over(end_.state, end_.reason);
    end_.message =
        spot_message(config, treatment, static_cast<int>(state_.attempts.size()), folder, "");
    tell(SessionPhase::kWriting, spot_);
  }

  void over(const AttemptOutcome& outcome) {
    if (failed_) {
      const fs::path folder = out_ / outcome.folder;
      const Treatment none;
      end_ = {
          .state = SafetyState::kSafeStop,
          .reason = SafetyReason::kSelfTest,
          .message = spot_message(session_.configs[session_.find(outcome.spot, "spot")], none,
                                  static_cast<int>(state_.attempts.size()), folder, outcome.why),
          .folder = folder};
      desk_.over(end_.state, end_.reason);
    }
    say("           {}{}, {:.3g} mJ\n", words_of(outcome.ending),
        outcome.why.empty() ? "" : " (" + outcome.why + ")", outcome.energy_mJ);
    desk_.end(std::move(end_));
  }

  After after(const AttemptOutcome& outcome) {
    if (outcome.ending != SpotEnding::kTreated) desk_.end_run_on();
    tell(SessionPhase::kAfter, outcome.spot);
    desk_.offer({"accept", "repeat", "end"});
    const After wanted = ask_after();
    desk_.offer({});
    tell(SessionPhase::kPreparing, "");
    return wanted;
  }

  After ask_after() {
    while (!over() && !stop_requested()) {
      if (desk_.runs_on()) return After::kAccept;
      if (terminal_.enter()) desk_.enter();
      const Desk::Wish wish = desk_.wait(kConsolePoll);
      if (wish == Desk::Wish::kReset) return After::kAccept;
      if (wish != Desk::Wish::kChoice) continue;
      if (desk_.choice() == "accept") return After::kAccept;
      return desk_.choice() == "repeat" ? After::kRepeat : After::kEnd;
    }
    return After::kEnd;
  }

  // After the session has ended: true to continue, by a choice or by Enter.
  bool goes_on() {
    desk_.rest();
    offer_with_repeat({"continue"});
    while (!over()) {
      if (terminal_.enter()) desk_.enter();
      const Desk::Wish wish = desk_.wait(kConsolePoll);
      if (wish != Desk::Wish::kReset && wish != Desk::Wish::kChoice) continue;
      if (wish == Desk::Wish::kChoice) repeats(desk_.choice());
      desk_.offer({});
      forget_stop();
      tell(SessionPhase::kPreparing, "");
      return true;
    }
    return false;
  }

  const Session& session_;
  fs::path out_;
  ConsoleDevice device_;
  Desk& desk_;
  const ConsoleServer& server_;
  const std::vector<Finding> findings_ = examine(own_privileges());
  Terminal terminal_;
  SessionOptions request_;
  std::vector<std::string> repeat_;  // spots, in the session's next run
  SessionState state_;
  SessionPhase phase_ = SessionPhase::kPreparing;
  std::string spot_;
  std::optional<Config> controlled_;  // of the spot that is asked about
  SpotEnd end_;
  bool failed_ = false;
  bool again_ = false;  // another run with a repetition, without asking
};

}  // namespace

int console_session(const ConsoleOptions& options) {
  const Session session = load_session(options.session);
  begin_session(options.out, session);
  const ConsoleDevice device = console_device(session.configs.front(), session.place);
  Desk desk({.browser_starts = device.browser_starts,
             .foxglove = options.foxglove,
             .period = shortest_period(session),
             .stop = ask_to_stop,
             .resume = forget_stop,
             .before = {}});
  const ConsoleServer server(console_settings(options), console_hooks(desk));
  stop_on_signals();
  say_address(options, server, device.browser_starts);
  return SessionBench(session, options, device, desk, server).serve();
}

}  // namespace photocoag
