// Rows of the fault table with the eye in this process and the controller in a child: S5, T3, T4,
// X2. Time is counted in the eye's periods, so that a busy machine changes nothing.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <span>

#include "photocoag/core/error.hpp"
#include "photocoag/core/random.hpp"
#include "photocoag/fault_table/process_bench.hpp"
#include "photocoag/fault_table/shared_eye.hpp"
#include "photocoag/rt/last_resort.hpp"

namespace photocoag {
namespace {

constexpr std::int64_t kPeriodNs = 1'000'000;
constexpr std::uint64_t kNever = UINT64_MAX;
constexpr std::uint64_t kStillDark = 2000;  // ticks: the controller never started

void fail() { throw 1; }

/// A controller that throws out of a noexcept function in one cycle.
struct ThrowingController {
  Controller inside;
  std::uint64_t at = kNever;
  std::uint64_t cycle = 0;
  Estimate observe(const Sample& sample) noexcept {
    if (cycle++ == at) fail();  // leaves a noexcept function
    return inside.observe(sample);
  }
  Decision decide() noexcept { return inside.decide(); }
  Estimate estimate() const noexcept { return inside.estimate(); }
};
Innovation innovation_of(const ThrowingController& c) noexcept {
  return photocoag::innovation_of(c.inside);
}

/// The child: treats until it is killed.
[[noreturn]] void control(const ProcessBench& bench, bool supervised, SharedEyeMemory& memory,
                          std::uint64_t throw_at) {
  const rlimit none{.rlim_cur = 0, .rlim_max = 0};
  setrlimit(RLIMIT_CORE, &none);
  try {
    SharedEyeDevice device(memory, 1e-3);
    const LastResort guard(device);
    SafetyLimits limits = safety_limits(bench.config);
    limits.overruns_in_a_row_max = 5;  // a busy machine; the stop of T3 lasts longer
    limits.overruns_per_hundred = 100;
    ThrowingController controller{bench.controller, throw_at};
    std::vector<CycleRecord> records(2000);
    if (supervised) {
      Supervisor supervisor = bench.supervisor(limits);
      run_loop(controller, device, supervisor, 1e-3, std::span(records));
    } else {
      Unsupervised nobody;
      run_loop(controller, device, nobody, 1e-3, std::span(records));
    }
  } catch (...) {
    // No light either.
  }
  _exit(0);
}

/// What the eye emitted, tick by tick, when `act` was called with the child's id after tick `when`.
struct Observed {
  std::vector<double> emitted;
  double peak = 0.0;
  int status = 0;

  bool ever_light() const {
    return std::any_of(emitted.begin(), emitted.end(), [](double power) { return power != 0.0; });
  }
  /// Ticks after `when` in which there was light.
  int lit_after(std::uint64_t when) const {
    int last = 0;
    for (std::size_t k = when + 1; k < emitted.size(); ++k) {
      if (emitted[k] != 0.0) last = static_cast<int>(k - when);
    }
    return last;
  }
};

template <typename Act>
Observed observe_once(const ProcessBench& bench, bool supervised, std::uint64_t when,
                      std::uint64_t ticks, Act act, std::uint64_t throw_at = kNever) {
  const SharedEyeMapping memory;
  SharedEyeServer server(*memory, bench.fresh_eye(when + 1));
  const pid_t child = fork();
  if (child == 0) control(bench, supervised, *memory, throw_at);
  Observed observed;
  if (child < 0) throw Error("no process");  // kill(-1, ...) would mean every process
  // Tick 0 is the first after the controller has written.
  std::int64_t start = monotonic_ns();
  for (std::uint64_t k = 0; k < kStillDark && memory->token.load() == 0; ++k) {
    start += kPeriodNs;
    wait_until(start);
    if (memory->token.load() == 0) server.tick();
  }
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    wait_until(start + static_cast<std::int64_t>(tick) * kPeriodNs);
    observed.emitted.push_back(server.tick());
    observed.peak = std::max(observed.peak, server.truth().peak);
    if (tick == when) act(child);
  }
  if (waitpid(child, &observed.status, WNOHANG) == 0) {  // alive, and still ours
    kill(child, SIGKILL);
    waitpid(child, &observed.status, 0);
  }
  return observed;
}

/// On a busy machine a controller may stop for overruns before there is any light: retry.
template <typename Act>
Observed observe(const ProcessBench& bench, bool supervised, std::uint64_t when,
                 std::uint64_t ticks, Act act, std::uint64_t throw_at = kNever) {
  Observed observed;
  for (int tries = 0; tries < 20 && !observed.ever_light(); ++tries) {
    observed = observe_once(bench, supervised, when, ticks, act, throw_at);
  }
  return observed;
}

/// A command written before the crash is fresh at the next tick and held for one more.
constexpr int kWatchdogTicks = 2;

void judge(FaultRow& row, const Observed& observed, int lit, std::string why) {
  if (why.empty() && lit > kWatchdogTicks) why = fmt::format("light {} periods later", lit);
  // The peak is reported, not judged: where eye and controller fight for one core, powers come
  // late.
  row.slowest = std::max(row.slowest, lit);
  row.peak = std::max(row.peak, observed.peak);
  count(row, why);
}

void killed(const ProcessFaultOptions& options, const ProcessBench& bench, FaultRow& row) {
  for (int run = 0; run < options.kills; ++run) {
    const auto draw = static_cast<std::uint64_t>(run);
    const auto when =
        static_cast<std::uint64_t>(1.0 + 29.0 * uniform(4, 2 * draw, RandomStream::kTest));
    const auto pause =
        static_cast<std::int64_t>(9e5 * uniform(4, 2 * draw + 1, RandomStream::kTest));
    const int signal = run % 3 == 0 ? SIGSEGV : SIGKILL;
    const Observed observed = observe(bench, options.supervised, when, when + 10, [&](pid_t child) {
      wait_until(monotonic_ns() + pause);  // anywhere in its cycle
      kill(child, signal);
      waitpid(child, nullptr, 0);  // it is dead before the next tick
    });
    judge(row, observed, observed.lit_after(when), observed.ever_light() ? "" : "never any light");
  }
}

void stopped(const ProcessFaultOptions& options, const ProcessBench& bench, FaultRow& row) {
  const std::uint64_t when = 20;
  pid_t waker = 0;
  const Observed observed = observe(bench, options.supervised, when, 120, [&](pid_t child) {
    if (waker > 0) waitpid(waker, nullptr, 0);
    kill(child, SIGSTOP);
    int status = 0;
    waitpid(child, &status, WUNTRACED);
    // Continued by a helper of ours while the eye goes on ticking.
    waker = fork();
    if (waker == 0) {
      wait_until(monotonic_ns() + 15 * kPeriodNs);
      kill(child, SIGCONT);
      _exit(0);
    }
  });
  if (waker > 0) waitpid(waker, nullptr, 0);
  judge(row, observed, observed.lit_after(when), observed.ever_light() ? "" : "never any light");
}

void thrown(const ProcessFaultOptions& options, const ProcessBench& bench, FaultRow& row) {
  const std::uint64_t at = 15;
  const Observed observed = observe(
      bench, options.supervised, kNever - 1, 60, [](pid_t) {}, at);
  const bool aborted = WIFSIGNALED(observed.status) && WTERMSIG(observed.status) == SIGABRT;
  // The child's cycle is the eye's tick, give or take what a busy machine delays.
  judge(row, observed, std::max(0, observed.lit_after(at) - 10),
        !observed.ever_light() ? "never any light"
        : aborted              ? ""
                               : "not aborted");
}

void second(FaultRow& row) {
  const SharedEyeMapping memory;
  const SharedEyeDevice first(*memory, 1e-3);
  const std::uint64_t token = memory->token.load();
  std::string why = "a second controller was let in";
  try {
    const SharedEyeDevice another(*memory, 1e-3);
  } catch (const Error&) {
    why = memory->token.load() == token ? "" : "the second one has written";
  }
  count(row, why);
}

}  // namespace

void run_eye_row(const ProcessFaultOptions& options, FaultRow& row) {
  for (const double absorption : options.absorptions) {
    if (row.id == "X2") {
      second(row);
      continue;
    }
    const ProcessBench bench(options, absorption);
    if (row.id == "T4") killed(options, bench, row);
    if (row.id == "T3") stopped(options, bench, row);
    if (row.id == "S5") thrown(options, bench, row);
  }
}

}  // namespace photocoag
