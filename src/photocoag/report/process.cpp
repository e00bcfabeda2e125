#include "photocoag/report/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// A file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor() = default;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }

  int get() const noexcept { return value_; }
  bool open() const noexcept { return value_ >= 0; }
  void set(int value) noexcept { value_ = value; }
  void close() noexcept {
    if (value_ >= 0) ::close(value_);
    value_ = -1;
  }

 private:
  int value_ = -1;
};

// One direction of a child's standard streams: our end and the child's.
struct Channel {
  Descriptor ours, theirs;

  // A socket pair, not a pipe: send() can be told not to raise SIGPIPE when the child has gone.
  Channel() {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      throw Error(std::string("cannot make a channel to another program: ") + std::strerror(errno));
    ours.set(ends[0]);
    theirs.set(ends[1]);
  }
};

class SpawnSettings {
 public:
  SpawnSettings(const Channel& in, const Channel& out, const Channel& err) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_adddup2(&actions_, in.theirs.get(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, out.theirs.get(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, err.theirs.get(), STDERR_FILENO);
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
  const ssize_t sent = ::send(to.get(), rest.data(), rest.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent >= 0) rest.remove_prefix(static_cast<std::size_t>(sent));
  const bool gone = sent < 0 && errno != EAGAIN && errno != EINTR;
  if (gone || rest.empty()) to.close();  // end of input; a child that has gone says why by its code
}

void receive_some(Descriptor& from, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t got = ::read(from.get(), buffer.data(), buffer.size());
  if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
  if (got == 0 || (got < 0 && errno != EINTR)) from.close();
}

// Feeds and drains all channels at once, so that neither side can block the other for ever.
void exchange(Channel& in, Channel& out, Channel& err, std::string_view input,
              ProgramResult& result) {
  if (input.empty()) in.ours.close();
  while (in.ours.open() || out.ours.open() || err.ours.open()) {
    std::array<pollfd, 3> waiting = {pollfd{in.ours.get(), POLLOUT, 0},
                                     pollfd{out.ours.get(), POLLIN, 0},
                                     pollfd{err.ours.get(), POLLIN, 0}};
    if (::poll(waiting.data(), waiting.size(), -1) < 0) continue;  // interrupted by a signal
    if (waiting[0].revents != 0) send_some(in.ours, input);
    if (waiting[1].revents != 0) receive_some(out.ours, result.output);
    if (waiting[2].revents != 0) receive_some(err.ours, result.errors);
  }
}

}  // namespace

ProgramResult run_program(const std::vector<std::string>& arguments, std::string_view input) {
  std::vector<std::string> words = arguments;
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const char* path = std::getenv("PATH");
  std::string path_entry = std::string("PATH=") + (path != nullptr ? path : "/usr/bin:/bin");
  std::string locale_entry = "LC_ALL=C.UTF-8";
  std::array<char*, 3> environment = {path_entry.data(), locale_entry.data(), nullptr};

  Channel in, out, err;
  pid_t child = 0;
  {
    const SpawnSettings settings(in, out, err);
    const int problem = ::posix_spawnp(&child, argv[0], settings.actions(), settings.attributes(),
                                       argv.data(), environment.data());
    if (problem == ENOENT) return {.found = false};
    if (problem != 0)
      throw Error({.where = arguments[0],
                   .problem = std::string("cannot be started: ") + std::strerror(problem)});
  }
  in.theirs.close();
  out.theirs.close();
  err.theirs.close();

  ProgramResult result;
  exchange(in, out, err, input, result);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace photocoag
