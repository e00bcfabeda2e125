// Rows of the fault table that need a process of their own to die in. The eye runs here, the
// controller in a child; time is counted in the eye's ticks, so that a busy machine changes nothing.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <vector>

#include "estimation/test_models.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/loop/treatment_loop.hpp"
#include "photocoag/rt/last_resort.hpp"
#include "photocoag/rt/shared_eye.hpp"
#include "safety/supervisors.hpp"

namespace photocoag::testing {
namespace {

constexpr std::int64_t kPeriodNs = 1'000'000;
constexpr std::uint64_t kNever = UINT64_MAX;

struct Mapping {
  Mapping()
      : memory(static_cast<SharedEyeMemory*>(mmap(nullptr, sizeof(SharedEyeMemory),
                                                  PROT_READ | PROT_WRITE,
                                                  MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {}
  ~Mapping() { munmap(memory, sizeof(SharedEyeMemory)); }
  SharedEyeMemory* memory;
};

void fail() { throw 1; }

/// A controller that breaks its promise in one cycle.
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

/// The child: treats until it is killed. Exit code 10 + state of the supervisor.
[[noreturn]] void control(SharedEyeMemory& memory, std::uint64_t throw_at) {
  const rlimit none{.rlim_cur = 0, .rlim_max = 0};
  setrlimit(RLIMIT_CORE, &none);
  int code = 1;
  try {
    SharedEyeDevice device(memory, 1e-3);
    set_last_resort([](void* d) noexcept { static_cast<SharedEyeDevice*>(d)->safe_off(); },
                    &device);
    SafetyLimits limits;
    limits.overruns_in_a_row_max = 5;  // a busy machine; the stop of T3 lasts longer
    limits.overruns_per_hundred = 100;
    Supervisor supervisor = treating_supervisor(model_1khz(), limits);
    ThrowingController controller{Controller(model_1khz(), {}, {}), throw_at};
    std::vector<CycleRecord> records(2000);
    std::atomic<std::size_t> progress{0};
    run_loop(controller, device, supervisor, 1e-3, std::span(records), progress);
    code = 10 + static_cast<int>(supervisor.status().state);
  } catch (...) {
  }
  _exit(code);
}

/// What the eye emitted, tick by tick, when `act` was called with the child's id after tick `when`.
struct Observed {
  std::vector<double> emitted;
  int status = 0;
};

template <typename Act>
Observed observe(std::uint64_t when, std::uint64_t ticks, Act act, std::uint64_t throw_at = kNever) {
  model_1khz();  // before the fork
  Mapping mapping;
  SharedEyeServer server(*mapping.memory,
                         SimulatedEye(ReducedPlant(model_1khz(), 1.1), 0.288, when + 1));
  const pid_t child = fork();
  if (child == 0) control(*mapping.memory, throw_at);
  Observed observed;
  if (child < 0) {  // kill(-1, ...) would mean every process
    ADD_FAILURE() << "no process";
    return observed;
  }
  // Tick 0 is the first after the controller has written.
  std::int64_t start = monotonic_ns();
  while (mapping.memory->token.load() == 0) {
    start += kPeriodNs;
    wait_until(start);
    if (mapping.memory->token.load() == 0) server.tick();
  }
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    wait_until(start + static_cast<std::int64_t>(tick) * kPeriodNs);
    observed.emitted.push_back(server.tick());
    if (tick == when) act(child);
  }
  if (waitpid(child, &observed.status, WNOHANG) == 0) {  // alive, and still ours
    kill(child, SIGKILL);
    waitpid(child, &observed.status, 0);
  }
  return observed;
}

bool dark_from(const Observed& observed, std::uint64_t first) {
  for (std::size_t k = first; k < observed.emitted.size(); ++k) {
    if (observed.emitted[k] != 0.0) return false;
  }
  return true;
}

bool ever_light(const Observed& observed) { return !dark_from(observed, 0); }

TEST(ProcessFaults, T4KilledAtRandomPointsTheEyeIsDarkWithinTwoPeriods) {
  Draw draw(4);
  int lit = 0;
  for (int run = 0; run < 100; ++run) {
    const auto when = static_cast<std::uint64_t>(draw.integer(1, 30));
    const int signal = run % 3 == 0 ? SIGSEGV : SIGKILL;
    const auto pause = static_cast<std::int64_t>(draw.between(0.0, 900'000.0));
    const Observed observed = observe(when, when + 10, [&](pid_t child) {
      wait_until(monotonic_ns() + pause);  // anywhere in its cycle
      kill(child, signal);
      waitpid(child, nullptr, 0);  // it is dead before the next tick
    });
    lit += ever_light(observed) ? 1 : 0;
    // A command written before death is fresh at the next tick, held for one more.
    EXPECT_TRUE(dark_from(observed, when + 3)) << "run " << run << ", killed after " << when;
  }
  // On a busy machine the controller may have stopped for overruns before.
  EXPECT_GE(lit, 80) << "there was light to switch off";
}

TEST(ProcessFaults, T3StoppedAndContinuedItNeverWritesLightAgain) {
  const std::uint64_t when = 20;
  pid_t stopped = 0;
  Observed observed;
  {
    observed = observe(when, 120, [&](pid_t child) {
      stopped = child;
      kill(child, SIGSTOP);
      int status = 0;
      waitpid(child, &status, WUNTRACED);
      // Continued by a helper of ours while the eye goes on ticking.
      if (fork() == 0) {
        wait_until(monotonic_ns() + 15 * kPeriodNs);
        kill(child, SIGCONT);
        _exit(0);
      }
    });
  }
  while (waitpid(-1, nullptr, WNOHANG) > 0) {
  }
  EXPECT_TRUE(ever_light(observed));
  EXPECT_TRUE(dark_from(observed, when + 3)) << "dark by itself, and after the resume";
}

TEST(ProcessFaults, S5AnExceptionThroughNoexceptSwitchesOffFirst) {
  const Observed observed = observe(kNever - 1, 60, [](pid_t) {}, 15);
  EXPECT_TRUE(ever_light(observed));
  EXPECT_TRUE(WIFSIGNALED(observed.status) && WTERMSIG(observed.status) == SIGABRT);
  // Cycle 15 is the eye's tick 15, give or take what a busy machine delays: two periods more.
  std::size_t last = 0;
  for (std::size_t k = 0; k < observed.emitted.size(); ++k) {
    if (observed.emitted[k] > 0.0) last = k;
  }
  EXPECT_LE(last, 30u);
}

TEST(ProcessFaults, X2ASecondControllerIsRefused) {
  Mapping mapping;
  const SharedEyeDevice first(*mapping.memory, 1e-3);
  const std::uint64_t token = mapping.memory->token.load();
  EXPECT_THROW(SharedEyeDevice(*mapping.memory, 1e-3), Error);
  EXPECT_EQ(mapping.memory->token.load(), token) << "no write from the second";
}

TEST(ProcessFaults, A4WithoutTheEyeTheControllerStops) {
  // Nobody ticks: every wait times out, the third stops.
  Mapping mapping;
  SharedEyeDevice device(*mapping.memory, 1e-3);
  Supervisor supervisor = treating_supervisor(model_1khz());
  Controller controller(model_1khz(), {}, {});
  std::vector<CycleRecord> records(20);
  std::atomic<std::size_t> progress{0};
  const LoopOutcome outcome =
      run_loop(controller, device, supervisor, 1e-3, std::span(records), progress);
  EXPECT_EQ(outcome.safety.state, SafetyState::kSafeStop);
  EXPECT_LE(outcome.safety.exposure, 3e-3);
  EXPECT_EQ(mapping.memory->command.load(), 0.0);
}

}  // namespace
}  // namespace photocoag::testing
