// Absolute deadlines: not early whatever happens, on a grid that never moves.
#include <gtest/gtest.h>

#include <signal.h>
#include <sys/mman.h>
#include <sys/time.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/clock_pace.hpp"
#include "photocoag/rt/real_time.hpp"
#include "support/heap_guard.hpp"

namespace photocoag::testing {
namespace {

constexpr std::int64_t kMs = 1'000'000;

std::atomic<int> signals{0};

/// SIGALRM every millisecond, without SA_RESTART, so that every sleep is interrupted.
class SignalStorm {
 public:
  SignalStorm() {
    signals = 0;
    struct sigaction action {};
    action.sa_handler = [](int) { signals.fetch_add(1, std::memory_order_relaxed); };
    sigaction(SIGALRM, &action, &before_);
    const itimerval every{.it_interval = {.tv_sec = 0, .tv_usec = 1000},
                          .it_value = {.tv_sec = 0, .tv_usec = 1000}};
    setitimer(ITIMER_REAL, &every, nullptr);
  }
  ~SignalStorm() {
    const itimerval never{};
    setitimer(ITIMER_REAL, &never, nullptr);
    sigaction(SIGALRM, &before_, nullptr);
  }
  SignalStorm(const SignalStorm&) = delete;
  SignalStorm& operator=(const SignalStorm&) = delete;

 private:
  struct sigaction before_ {};
};

TEST(Clock, WaitUntilIsNeverEarly) {
  for (const std::int64_t ahead : {std::int64_t{1}, std::int64_t{1000}, kMs / 10, kMs, 7 * kMs}) {
    const std::int64_t deadline = monotonic_ns() + ahead;
    wait_until(deadline);
    EXPECT_GE(monotonic_ns(), deadline) << ahead;
  }
}

TEST(Clock, SignalsDoNotShortenTheWait) {
  const SignalStorm storm;
  const std::int64_t deadline = monotonic_ns() + 25 * kMs;
  wait_until(deadline);
  EXPECT_GE(monotonic_ns(), deadline);
  EXPECT_GT(signals.load(), 2) << "the storm did not reach this sleep";
}

TEST(Clock, ADeadlineInThePastReturns) {
  // Would hang (and run into the test's time limit) if it waited for the clock to come round.
  wait_until(monotonic_ns() - 3'600'000 * kMs);
  wait_until(0);
  SUCCEED();
}

TEST(Clock, IsMonotonic) {
  std::int64_t last = monotonic_ns();
  for (int k = 0; k < 100000; ++k) {
    const std::int64_t now = monotonic_ns();
    ASSERT_GE(now, last);
    last = now;
  }
}

TEST(ClockPace, WaitsForDeadlinesOnTheGrid) {
  ClockPace pace(2e-3);
  const std::int64_t before = monotonic_ns();
  pace.start();
  std::size_t cycle = 0;
  while (cycle < 10) {
    const std::size_t missed = pace.wait_for_end_of(cycle);
    // Not before t0 + (k + 1) T, however late the cycles before have been.
    ASSERT_GE(monotonic_ns(), before + static_cast<std::int64_t>(cycle + 1) * 2 * kMs);
    cycle += 1 + missed;
  }
}

TEST(ClockPace, CountsThePeriodsOfALongSleepAndKeepsThePhase) {
  constexpr std::int64_t kPeriod = 2 * kMs;
  ClockPace pace(2e-3);
  const std::int64_t before = monotonic_ns();
  pace.start();
  const std::int64_t started = monotonic_ns();
  std::size_t cycle = 0;
  for (std::size_t wait = 0; wait < 3; ++wait) {
    // Sleep past the end of this cycle and of at least two more.
    wait_until(started + static_cast<std::int64_t>(cycle + 3) * kPeriod);
    const std::int64_t asked = monotonic_ns();
    const std::size_t missed = pace.wait_for_end_of(cycle);
    const std::int64_t answered = monotonic_ns();
    const std::int64_t late = pace.woke_ns() - pace.deadline_ns(cycle);
    EXPECT_GE(missed, 2u);
    EXPECT_EQ(missed, static_cast<std::size_t>(late / kPeriod));
    // Woken between `asked` and `answered`, `late` after t0 + (k + 1) T with t0 between `before`
    // and `started`: true however slow the machine is, false for a grid that moved with the sleep.
    const std::int64_t end = static_cast<std::int64_t>(cycle + 1) * kPeriod;
    EXPECT_LE(asked - late, started + end);
    EXPECT_GE(answered - late, before + end);
    cycle += 1 + missed;
  }
}

TEST(ClockPace, AllocatesNothing) {
  ClockPace pace(1e-4);
  const HeapGuard guard;
  pace.start();
  for (std::size_t k = 0; k < 25; ++k) pace.wait_for_end_of(k);
  EXPECT_EQ(guard.use(), HeapUse{});
}

TEST(RealTime, DescribesWhatWasGranted) {
  EXPECT_EQ((RealTime{.fifo_priority = true, .locked_memory = true}).describe(),
            "SCHED_FIFO, memory locked");
  EXPECT_EQ(RealTime{}.describe(), "ordinary scheduling, memory not locked");
  EXPECT_EQ((RealTime{.core = 3}).describe(), "ordinary scheduling, memory not locked, core 3");
}

TEST(RealTime, PinsToTheCoreAskedForAndKeepsOffAForeignOne) {
  const int last = std::stoi(allowed_cores().substr(allowed_cores().rfind(' ') + 1));
  const auto on_a_thread = [](auto action) {
    std::string cores;
    std::thread([&] {
      action();
      cores = allowed_cores();
    }).join();
    return cores;
  };
  const std::string all = allowed_cores();
  int got = kAnyCore;
  EXPECT_EQ(on_a_thread([&] { got = request_real_time(last).core; }), std::to_string(last));
  EXPECT_EQ(got, last);
  EXPECT_EQ(on_a_thread([&] { got = request_real_time(1023).core; }), all) << "no such core";
  EXPECT_EQ(got, kAnyCore);
  const std::string others = on_a_thread([&] { keep_off_core(last); });
  if (all.find(',') == std::string::npos) {
    EXPECT_EQ(others, all) << "the only one";
  } else {
    EXPECT_EQ(others, all.substr(0, all.rfind(',')));
  }
}

TEST(RealTime, PageFaultsAreThoseOfTheThread) {
  constexpr std::size_t kPages = 64;
  PageFaults touched;
  PageFaults again;
  std::thread([&] {
    const std::size_t size = kPages * 4096;
    void* fresh = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(fresh, MAP_FAILED);
    munlock(fresh, size);  // an earlier test may have locked the process's future memory
    madvise(fresh, size, MADV_NOHUGEPAGE);
    volatile auto* bytes = static_cast<unsigned char*>(fresh);
    const auto touch = [&] {
      for (std::size_t page = 0; page < kPages; ++page) bytes[page * 4096] = 1;
    };
    touch();
    PageFaults before = page_faults();
    touch();
    again = page_faults() - before;
    EXPECT_EQ(madvise(fresh, size, MADV_DONTNEED), 0);
    before = page_faults();
    touch();
    touched = page_faults() - before;
    munmap(fresh, size);
  }).join();
  EXPECT_EQ(again.minor, 0);
  EXPECT_GE(touched.minor, static_cast<std::int64_t>(kPages));
}

}  // namespace
}  // namespace photocoag::testing
