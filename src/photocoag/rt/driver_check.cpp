#include "photocoag/rt/driver_check.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <filesystem>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/rt/driver_promises.hpp"

namespace photocoag {
namespace {

// What a child says: a letter, then words.
constexpr char kKept = 'k', kBroken = 'b', kUnopened = 'u', kSkipped = 's';

std::string said_by(const Promise& promise, const DriverCheckSettings& settings) {
  try {
    promise.keep(settings);
    return {kKept};
  } catch (const BrokenPromise& broken) {
    return kBroken + broken.why;
  } catch (const UnopenedDevice& unopened) {
    return kUnopened + unopened.why;
  } catch (const NotTried& not_tried) {
    return kSkipped + not_tried.why;
  } catch (const std::exception& error) {
    return kBroken + std::string("an exception: ") + error.what();
  }
}

struct Ended {
  std::string said;
  int status = 0;
  bool in_time = true;
};

// In a process of its own, which ends without destructors and with this process.
Ended run_apart(const Promise& promise, const DriverCheckSettings& settings) {
  int ends[2];
  if (pipe(ends) != 0) throw Error(fmt::format("no pipe: {}", std::strerror(errno)));
  const pid_t child = fork();
  if (child < 0) throw Error(fmt::format("no process: {}", std::strerror(errno)));
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    close(ends[0]);
    const std::string said = said_by(promise, settings);
    const ssize_t written = write(ends[1], said.data(), said.size());
    _exit(written == static_cast<ssize_t>(said.size()) ? 0 : 1);
  }
  close(ends[1]);
  using namespace std::chrono;
  const auto deadline = steady_clock::now() + duration<double>(settings.patience);
  Ended ended;
  while (true) {
    const auto left = duration_cast<milliseconds>(deadline - steady_clock::now()).count();
    pollfd input{.fd = ends[0], .events = POLLIN, .revents = 0};
    ended.in_time = left > 0 && poll(&input, 1, static_cast<int>(left)) > 0;
    char buffer[4096];
    const ssize_t size = ended.in_time ? read(ends[0], buffer, sizeof buffer) : 0;
    if (size <= 0) break;
    ended.said.append(buffer, static_cast<std::size_t>(size));
  }
  close(ends[0]);
  if (!ended.in_time) kill(child, SIGKILL);
  waitpid(child, &ended.status, 0);
  return ended;
}

void require_promise(const std::string& name) {
  if (name.empty()) return;
  std::string all;
  for (const Promise& promise : driver_promises()) {
    if (promise.name == name) return;
    all += (all.empty() ? "" : ", ") + promise.name;
  }
  throw Error(ErrorParts{.where = "--only", .found = name, .accepted = all});
}

}  // namespace

DriverCheck check_driver(const DriverCheckSettings& settings) {
  if (!std::filesystem::is_regular_file(settings.library)) {
    throw Error(ErrorParts{.where = "LIBRARY",
                           .problem = "there is no such file",
                           .found = settings.library,
                           .accepted = "a shared library; docs/devices.md"});
  }
  require_promise(settings.only);
  DriverCheck check;
  for (const Promise& promise : driver_promises()) {
    // The table is always looked at: it says whether light may come out.
    const bool first = &promise == &driver_promises().front();
    if (!first && !settings.only.empty() && settings.only != promise.name) continue;
    PromiseResult result{.promise = promise.name, .means = promise.means, .why = {}};
    if (!check.unopened.empty()) {
      check.results.push_back(std::move(result));
      continue;
    }
    const Ended ended = run_apart(promise, settings);
    const std::string words = ended.said.empty() ? std::string() : ended.said.substr(1);
    const char verdict = ended.said.empty() ? '\0' : ended.said.front();
    if (verdict == kUnopened && first) {
      throw Error(ErrorParts{.where = settings.library, .problem = words});
    }
    if (verdict == kUnopened) {
      check.unopened = words.empty() ? "no message" : words;
      check.results.push_back(std::move(result));
      continue;
    }
    result.verdict = verdict == kKept      ? PromiseVerdict::kKept
                     : verdict == kSkipped ? PromiseVerdict::kNotTried
                                           : PromiseVerdict::kBroken;
    result.why = words;
    if (!ended.in_time) {
      result.why = fmt::format("no end after {:g} s: a call does not return", settings.patience);
    } else if (verdict == '\0') {
      result.why = WIFSIGNALED(ended.status)
                       ? fmt::format("the process died of signal {} ({})", WTERMSIG(ended.status),
                                     strsignal(WTERMSIG(ended.status)))
                       : "the process ended within a call";
    }
    // Without a table there is nothing to call.
    const bool no_table = first && result.verdict == PromiseVerdict::kBroken;
    check.results.push_back(std::move(result));
    if (no_table) break;
  }
  return check;
}

}  // namespace photocoag
