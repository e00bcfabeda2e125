// `photocoag session`: many spots with one device into one folder.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "command.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "options.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/session/learning_study.hpp"
#include "photocoag/session/run_session.hpp"
#include "photocoag/session/session_record.hpp"
#include "session_ends.hpp"

namespace photocoag {
namespace {

struct SessionCommandOptions {
  std::string file;
  std::string out;                  ///< session folder
  std::vector<std::string> repeat;  ///< spots to treat again
  bool ask = false;
  bool json = false;      ///< the outcome as JSON on standard output
  std::size_t study = 0;  ///< instead: so many simulated sessions with and without learning
  bool no_cache = false;
};

namespace fs = std::filesystem;

// A line of standard input, or nothing: its end, or Ctrl-C.
std::optional<std::string> answer() {
  std::string line;
  while (!stop_requested()) {
    pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    if (poll(&input, 1, 50) <= 0) continue;
    char letter = 0;
    if (read(STDIN_FILENO, &letter, 1) != 1) return std::nullopt;
    if (letter == '\n') return line;
    if (line.size() < 80) line += letter;
  }
  return std::nullopt;
}

// One of the letters of `choices`; the first for an empty line; 0 at the end of input.
char ask(const std::string& question, std::string_view choices) {
  while (true) {
    say("{}", question);
    const std::optional<std::string> line = answer();
    if (!line) return 'e';
    if (line->empty()) return choices.front();
    if (line->size() == 1 && choices.find(line->front()) != std::string_view::npos) {
      return line->front();
    }
  }
}

SessionOperator operator_of(bool asks) {
  using Before = SessionOperator::Before;
  using After = SessionOperator::After;
  SessionOperator made;
  made.begins = [](const SpotPlan& spot, const Config& config, int attempt) {
    say("spot {:<6} {}{:g} K, prior of alpha {:.3f} +- {:.3f}\n", spot.name,
        attempt > 1 ? fmt::format("attempt {}, ", attempt) : "", config.control.peak_reference,
        config.estimator.absorption_initial, config.estimator.absorption_sigma_initial);
  };
  made.over = [](const AttemptOutcome& spot) {
    const bool truth = std::isfinite(spot.peak_true_max_K);
    say("           {}{}; {} peak at most {:.2f} K, alpha {:.3f} +- {:.3f}, {:.3g} mJ\n",
        words_of(spot.ending), spot.why.empty() ? "" : " (" + spot.why + ")",
        truth ? "true" : "estimated", truth ? spot.peak_true_max_K : spot.peak_estimate_max_K,
        spot.absorption, spot.absorption_sigma, spot.energy_mJ);
  };
  if (!asks) return made;
  made.before = [](const SpotPlan& spot) {
    const char choice = ask(fmt::format("spot {}: [t]reat, [s]kip, [e]nd? ", spot.name), "tse");
    return choice == 't' ? Before::kTreat : choice == 's' ? Before::kSkip : Before::kEnd;
  };
  made.after = [](const AttemptOutcome& spot) {
    const char choice = ask(fmt::format("spot {}: [a]ccept, [r]epeat, [e]nd? ", spot.spot), "are");
    return choice == 'a' ? After::kAccept : choice == 'r' ? After::kRepeat : After::kEnd;
  };
  return made;
}

int study(const SessionCommandOptions& options, const Session& session) {
  const LearningStudy found = learning_study(session, options.study, !options.no_cache);
  print("{} sessions of {} spots, spots 2 to {}, each session with and without learning\n",
        found.sessions, found.spots, found.spots);
  print("{:<44} {:>9} {:>9} {:>10}  {}\n", "mean over the sessions", "without", "with",
        "difference", "95 % interval");
  for (const LearningRow& row : found.rows) {
    const double half = 1.96 * row.difference_error;
    print("{:<44} {:>9.3f} {:>9.3f} {:>+10.3f}  {:+.3f} to {:+.3f}\n",
          fmt::format("{}, {}", row.measure, row.unit), row.without, row.with, row.difference,
          row.difference - half, row.difference + half);
  }
  return 0;
}

int session_command(const SessionCommandOptions& options) {
  const Session session = load_session(options.file);
  if (options.study > 0) return study(options, session);
  begin_session(options.out, session);
  stop_on_signals();
  const SessionOptions request{.out = options.out,
                               .repeat = options.repeat,
                               .use_cache = !options.no_cache,
                               .ask = operator_of(options.ask)};
  std::atomic<std::size_t> progress{0};
  const SessionResult result = run_session(session, request, stop_requested(), progress);
  const int code = finish_session(request.out, session, result);
  return with_json(options.json, "session", code, request.out,
                   summary_object(session_summary_json(session, result)));
}

const Command kSession(
    "session",
    "treat many spots with one device into one folder: a list or grid, with limits for the session",
    session_command, [](CommandLine& command, SessionCommandOptions& options) {
      command.add_option("FILE", options.file, "session file (TOML; docs/sessions.md)").required();
      command
          .add_option("--out", options.out,
                      "folder, new, empty, or that of the same session, which is continued")
          .type_name("DIR");
      command
          .add_option("--repeat", options.repeat,
                      "treat this spot again, regardless of its outcome; may be repeated")
          .type_name("SPOT")
          .one_value_each();
      command.add_flag(
          "--ask", options.ask,
          "ask on the terminal before and after every spot: treat, skip, accept, repeat");
      command
          .add_option("--study", options.study,
                      "instead: this many simulated sessions, with and without session.learn")
          .check(whole_number_from(2, 100000))
          .type_name("N");
      add_json(command, options.json).excludes("--study");
      command.add_flag("--no-cache", options.no_cache,
                       "make the reduced models again, without the cache");
      command.footer(
          footer("  photocoag session studies/sessions/grid.toml --out runs/grid\n"
                 "  photocoag session studies/sessions/grid.toml --out runs/grid --repeat B2\n"
                 "  photocoag session studies/sessions/grid.toml --out runs/asked --ask\n"
                 "  photocoag session studies/sessions/patient.toml --study 100\n"
                 "A session that was killed continues with the same command. A spot that may have "
                 "emitted is not repeated\n"
                 "without --repeat. Ctrl-C puts the laser to 0 W and writes the whole folder."));
    });

}  // namespace

}  // namespace photocoag
