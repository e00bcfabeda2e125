#include "photocoag/rt/clock.hpp"

#include <cerrno>
#include <ctime>

namespace photocoag {
namespace {
constexpr std::int64_t kNsPerSecond = 1'000'000'000;
}

std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * kNsPerSecond + now.tv_nsec;
}

void wait_until(std::int64_t deadline_ns) noexcept {
  const timespec deadline{.tv_sec = static_cast<std::time_t>(deadline_ns / kNsPerSecond),
                          .tv_nsec = static_cast<long>(deadline_ns % kNsPerSecond)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr) == EINTR) {
    // A signal: the loop looks at its stop flag at the deadline, at most one period away.
  }
}

}  // namespace photocoag
