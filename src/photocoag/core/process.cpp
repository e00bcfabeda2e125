#include "photocoag/core/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>

#include "photocoag/core/descriptor.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/stop_signal.hpp"

namespace photocoag {
namespace {

// One direction of a child's standard streams: our end and the child's.
struct Channel {
  Descriptor ours, theirs;

  // A socket pair, not a pipe: send() can be told not to raise SIGPIPE when the child has gone.
  Channel() {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      throw Error(std::string("cannot make a channel to another program: ") + std::strerror(errno));
    ours = Descriptor(ends[0]);
    theirs = Descriptor(ends[1]);
  }
};

class SpawnSettings {
 public:
  SpawnSettings(const Channel& in, const Channel& out, const Channel& err) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_adddup2(&actions_, in.theirs.number(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, out.theirs.number(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, err.theirs.number(), STDERR_FILENO);
    posix_spawnattr_init(&attributes_);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setpgroup(&attributes_, 0);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }

  const posix_spawn_file_actions_t* actions() const noexcept { return &actions_; }
  const posix_spawnattr_t* attributes() const noexcept { return &attributes_; }

 private:
  posix_spawn_file_actions_t actions_;
  posix_spawnattr_t attributes_;
};

void send_some(Descriptor& to, std::string_view& rest) {
  const ssize_t sent = ::send(to.number(), rest.data(), rest.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent >= 0) rest.remove_prefix(static_cast<std::size_t>(sent));
  const bool gone = sent < 0 && errno != EAGAIN && errno != EINTR;
  if (gone || rest.empty()) to.close();  // end of input; a child that has gone says why by its code
}

void receive_some(Descriptor& from, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t got = ::read(from.number(), buffer.data(), buffer.size());
  if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
  if (got == 0 || (got < 0 && errno != EINTR)) from.close();
}

// Waiting ends on a timeout or a stop request.
class Patience {
 public:
  explicit Patience(double seconds)
      : end_(Clock::now() +
             std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))) {}

  bool stopped() const noexcept { return stop_requests() != stops_; }
  bool over() const noexcept { return stopped() || Clock::now() >= end_; }
  // A signal that arrives between the check and the wait is noticed at the next check.
  int milliseconds(int at_most) const noexcept {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end_ - Clock::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, at_most));
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point end_;
  int stops_ = stop_requests();
};

// Feeds and drains all channels at once, so that neither side can block the other for ever.
void exchange(Channel& in, Channel& out, Channel& err, std::string_view input,
              const Patience& patience, ProgramResult& result) {
  if (input.empty()) in.ours.close();
  while ((in.ours.open() || out.ours.open() || err.ours.open()) && !patience.over()) {
    std::array<pollfd, 3> waiting = {pollfd{in.ours.number(), POLLOUT, 0},
                                     pollfd{out.ours.number(), POLLIN, 0},
                                     pollfd{err.ours.number(), POLLIN, 0}};
    if (::poll(waiting.data(), waiting.size(), patience.milliseconds(100)) < 0) continue;
    if (waiting[0].revents != 0) send_some(in.ours, input);
    if (waiting[1].revents != 0) receive_some(out.ours, result.output);
    if (waiting[2].revents != 0) receive_some(err.ours, result.errors);
  }
}

// `target` is what to kill: the child, or its group (negative).
std::optional<int> wait_or_kill(pid_t child, pid_t target, const Patience& patience) {
  int status = 0;
  for (pid_t ended = 0; !patience.over();) {
    ended = ::waitpid(child, &status, WNOHANG);
    if (ended == child) return status;
    if (ended < 0 && errno != EINTR) return std::nullopt;
    ::poll(nullptr, 0, patience.milliseconds(2));
  }
  ::kill(target, SIGKILL);
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return std::nullopt;
}

}  // namespace

std::optional<int> wait_for_child(pid_t child, double patience) {
  return wait_or_kill(child, child, Patience(patience));
}

ProgramResult run_program(const std::vector<std::string>& arguments,
                          const ProgramOptions& options) {
  std::vector<std::string> words = arguments;
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const char* path = std::getenv("PATH");
  std::string path_entry = std::string("PATH=") + (path != nullptr ? path : "/usr/bin:/bin");
  std::string locale_entry = "LC_ALL=C.UTF-8";
  std::array<char*, 3> environment = {path_entry.data(), locale_entry.data(), nullptr};

  const Patience patience(options.patience);
  Channel in, out, err;
  pid_t child = 0;
  {
    const SpawnSettings settings(in, out, err);
    const int problem =
        ::posix_spawnp(&child, argv[0], settings.actions(), settings.attributes(), argv.data(),
                       options.whole_environment ? environ : environment.data());
    if (problem == ENOENT) return {.found = false};
    if (problem != 0)
      throw Error({.where = arguments[0],
                   .problem = std::string("cannot be started: ") + std::strerror(problem)});
  }
  in.theirs.close();
  out.theirs.close();
  err.theirs.close();

  ProgramResult result;
  exchange(in, out, err, options.input, patience, result);
  const std::optional<int> status = wait_or_kill(child, -child, patience);
  if (!status) {
    throw Error({.where = arguments[0],
                 .problem = patience.stopped()
                                ? "stopped, as asked by a signal"
                                : fmt::format("has not ended after {:g} s", options.patience)});
  }
  result.exit_code = WIFEXITED(*status) ? WEXITSTATUS(*status) : 128 + WTERMSIG(*status);
  return result;
}

}  // namespace photocoag
