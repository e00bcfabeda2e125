#include "photocoag/rt/real_time.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <cstddef>

namespace photocoag {
namespace {

// Without locked memory the first deep call would fault in untouched pages.
void touch_stack() noexcept {
  constexpr std::size_t kDepth = 256 * 1024;  // the loop uses some 10 KiB
  constexpr std::size_t kPage = 4096;
  volatile unsigned char stack[kDepth];
  for (std::size_t at = 0; at < kDepth; at += kPage) stack[at] = 0;
  static_cast<void>(stack[0]);
}

}  // namespace

bool request_fifo_priority(int priority) noexcept {
  const sched_param parameters{.sched_priority = priority};
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
}

RealTime request_real_time(int core) noexcept {
  constexpr int kPriority = 60;  // above ordinary interrupts' threads, below the kernel's watchdogs
  RealTime granted;
  granted.fifo_priority = request_fifo_priority(kPriority);
  granted.locked_memory = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  touch_stack();
  granted.cores = count_allowed_cores();
  if (core != kAnyCore && pin_to_core(core)) granted.core = core;
  return granted;
}

bool pin_to_core(int core) noexcept {
  if (core < 0 || core >= CPU_SETSIZE) return false;
  cpu_set_t only;
  CPU_ZERO(&only);
  CPU_SET(core, &only);
  return sched_setaffinity(0, sizeof(only), &only) == 0;
}

void keep_off_core(int core) noexcept {
  cpu_set_t allowed;
  if (core < 0 || core >= CPU_SETSIZE || sched_getaffinity(0, sizeof(allowed), &allowed) != 0) {
    return;
  }
  CPU_CLR(core, &allowed);
  if (CPU_COUNT(&allowed) > 0) sched_setaffinity(0, sizeof(allowed), &allowed);
}

std::string allowed_cores() {
  cpu_set_t allowed;
  std::string text;
  if (sched_getaffinity(0, sizeof(allowed), &allowed) != 0) return text;
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (CPU_ISSET(core, &allowed)) text += (text.empty() ? "" : ", ") + std::to_string(core);
  }
  return text;
}

int count_allowed_cores() noexcept {
  cpu_set_t allowed;
  return sched_getaffinity(0, sizeof(allowed), &allowed) == 0 ? CPU_COUNT(&allowed) : 1;
}

PageFaults page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {.minor = usage.ru_minflt, .major = usage.ru_majflt};
}

std::string RealTime::describe() const {
  return std::string(fifo_priority ? "SCHED_FIFO" : "ordinary scheduling") +
         (locked_memory ? ", memory locked" : ", memory not locked") +
         (core == kAnyCore ? "" : ", core " + std::to_string(core));
}

}  // namespace photocoag
