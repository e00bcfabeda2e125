// `photocoag faults --kills N`: controllers that die or are stopped beside an eye in another
// process, in wall time. Rows T3 and T4 of the fault table.
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "console.hpp"
#include "faults.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/core/temporary_folder.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/eye_link.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/eye_process.hpp"
#include "photocoag/run/treatment.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMs = 1'000'000;  // ns
constexpr double kTestPower = 2e-3;      // W; the self-test's is below

pid_t start_controller(const std::string& config, const std::string& socket,
                       const std::string& out) {
  std::vector<std::string> words = {"photocoag", "treat",         "--config", config,
                                    "--device",  "eye:" + socket, "--out",    out};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, STDERR_FILENO, "/dev/null", 1 /* O_WRONLY */, 0);
  pid_t id = -1;
  const int failed = posix_spawn(&id, "/proc/self/exe", &quiet, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&quiet);
  if (failed != 0) throw Error("the controller's process cannot be started");
  return id;
}

/// Reads the eye's last pulses, independently of the controller.
class Observer {
 public:
  explicit Observer(const std::string& socket) : memory_(observe_eye(socket)) {}

  std::uint64_t pulses() const { return memory_->pulses.load(std::memory_order_acquire); }
  double power_now() const {
    const std::uint64_t n = pulses();
    return n == 0 ? 0.0 : memory_->records[(n - 1) % kEyeRing].power_readback;
  }
  /// When the last pulse with light among those since `first` was fired, ns; 0: none.
  std::int64_t last_light(std::uint64_t first) const {
    const std::uint64_t n = pulses();
    std::int64_t last = 0;
    for (std::uint64_t p = std::max(first, n > 2000 ? n - 2000 : 0); p < n; ++p) {
      const PulseRecord& record = memory_->records[p % kEyeRing];
      if (record.power_readback > 0.0) last = std::max(last, record.time_ns);
    }
    return last;
  }

 private:
  Mapped<const EyeSharedMemory> memory_;
};

struct Trial {
  bool light = false;        // at the moment of the signal
  double dark_after = 0.0;   // ms from the signal to the last pulse with light; 0: none
  bool light_again = false;  // after SIGCONT
};

Trial run_trial(Observer& observer, pid_t controller, double moment_ms, bool stop_only) {
  Trial trial;
  const std::int64_t give_up = monotonic_ns() + 20'000 * kMs;
  while (observer.power_now() < kTestPower && monotonic_ns() < give_up) {
    wait_until(monotonic_ns() + kMs / 10);
  }
  wait_until(monotonic_ns() + static_cast<std::int64_t>(moment_ms * static_cast<double>(kMs)));
  trial.light = observer.power_now() > 0.0;
  kill(controller, stop_only ? SIGSTOP : SIGKILL);
  waitpid(controller, nullptr, stop_only ? WUNTRACED : 0);
  const std::int64_t signalled = monotonic_ns();
  const std::uint64_t first = observer.pulses();
  wait_until(signalled + 20 * kMs);
  if (const std::int64_t last = observer.last_light(first > 0 ? first - 1 : 0); last > signalled) {
    trial.dark_after = static_cast<double>(last - signalled) / static_cast<double>(kMs);
  }
  if (stop_only) {
    const std::uint64_t resumed = observer.pulses();
    kill(controller, SIGCONT);
    wait_until(monotonic_ns() + 100 * kMs);
    trial.light_again = observer.last_light(resumed) > 0;
    kill(controller, SIGKILL);
    waitpid(controller, nullptr, 0);
  }
  return trial;
}

}  // namespace

int kill_trials(const FaultsOptions& options) {
  say("photocoag {}: {}\n", version(), kResearchNotice);
  const fs::path folder = make_temporary_folder("photocoag-kills-");
  Config config =
      for_device(load_config("", {"photoacoustics.baseline_pulses=1000", "safety.real_time=enforce",
                                  "photoacoustics.eye_pacing=wall"}),
                 parse_device("eye"));
  bool strict = true;
  try {
    require_real_time(config);
  } catch (const Error&) {
    strict = false;  // without it a controller that was stopped may go on treating
    config.safety.real_time = RealTimeMode::kObserve;
  }
  const std::string file = (folder / "config.toml").string();
  write_file(file, to_toml(config));
  const double period_ms = config.control.period * 1e3;
  int lit = 0;
  int late = 0;
  int again = 0;
  double slowest = 0.0;
  const int count = options.kills + options.stops;
  {
    const EyeProcess eye(file, {}, false);
    Observer observer(eye.socket());
    for (int i = 0; i < count; ++i) {
      draw_progress("killing", static_cast<double>(i) / count, "controllers");
      const bool stop_only = i >= options.kills;
      command_eye(eye.socket(), "cold");
      const pid_t controller =
          start_controller(file, eye.socket(), (folder / fmt::format("{}", i)).string());
      const double moment = 200.0 * uniform(1, static_cast<std::uint64_t>(i), RandomStream::kStudy);
      const Trial trial = run_trial(observer, controller, moment, stop_only);
      lit += trial.light ? 1 : 0;
      late += trial.dark_after > 2.0 * period_ms ? 1 : 0;
      again += trial.light_again ? 1 : 0;
      slowest = std::max(slowest, trial.dark_after);
    }
    clear_progress();
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  print("{} controllers killed, {} stopped for 20 ms; {} of them while there was light\n",
        options.kills, options.stops, lit);
  print("dark within two periods ({:g} ms): {} of {}; slowest {:.2f} ms\n", 2.0 * period_ms,
        count - late, count, slowest);
  if (options.stops > 0) {
    print("light after the resume: {} of {}{}\n", again, options.stops,
          strict ? "" : " (real time is not granted here: not judged)");
  }
  return late == 0 && (again == 0 || !strict) ? 0 : 1;
}

}  // namespace photocoag
