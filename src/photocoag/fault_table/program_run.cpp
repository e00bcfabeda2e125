#include "photocoag/fault_table/program_run.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <optional>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/process.hpp"
#include "photocoag/core/stop_signal.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience = 600.0;  // s, far more than any of these runs takes

void give_up_privileges() {
  const rlimit none{.rlim_cur = 0, .rlim_max = 0};
  setrlimit(RLIMIT_RTPRIO, &none);
  setrlimit(RLIMIT_MEMLOCK, &none);
  constexpr unsigned long kLockMemory = 14;  // CAP_IPC_LOCK
  constexpr unsigned long kNice = 23;        // CAP_SYS_NICE
  constexpr unsigned long kResource = 24;    // CAP_SYS_RESOURCE
  for (const unsigned long capability : {kLockMemory, kNice, kResource}) {
    prctl(PR_CAPBSET_DROP, capability, 0, 0, 0);  // root loses it at exec; others never had it
  }
}

}  // namespace

ProgramRun run_program(const ProcessFaultOptions& options, const fs::path& folder,
                       Arguments arguments, const RunSetup& setup) {
  arguments.insert(arguments.begin(), options.program);
  std::vector<char*> words;
  for (std::string& word : arguments) words.push_back(word.data());
  words.push_back(nullptr);
  const std::string said = (folder / "said.txt").string();
  const int output = ::open(said.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  const pid_t child = fork();
  if (child == 0) {
    dup2(output, 1);
    dup2(output, 2);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);
    if (setup.unprivileged) give_up_privileges();
    for (const std::string& variable : setup.environment) {
      putenv(const_cast<char*>(variable.c_str()));
    }
    if (chdir(folder.c_str()) == 0) execv(options.program.c_str(), words.data());
    _exit(127);
  }
  if (child < 0 || output < 0) throw Error("no process");
  if (setup.during) setup.during(child);
  const std::optional<int> status = wait_for_child(child, kPatience);
  ::close(output);
  if (!status && stop_requested()) throw Error("stopped, as asked by a signal");
  const int end = status.value_or(SIGKILL);
  return {.code = WIFSIGNALED(end) ? 256 + WTERMSIG(end) : WEXITSTATUS(end),
          .said = read_file(said, std::size_t{1} << 26)};
}

std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of('\n');
  if (end == std::string::npos) return {};
  return text.substr(text.rfind('\n', end) + 1, 160);
}

}  // namespace photocoag
