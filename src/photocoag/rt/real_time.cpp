#include "photocoag/rt/real_time.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

namespace photocoag {

bool request_fifo_priority(int priority) noexcept {
  const sched_param parameters{.sched_priority = priority};
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
}

RealTime request_real_time() noexcept {
  constexpr int kPriority = 60;  // above ordinary interrupts' threads, below the kernel's watchdogs
  RealTime granted;
  granted.fifo_priority = request_fifo_priority(kPriority);
  granted.locked_memory = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  return granted;
}

std::string RealTime::describe() const {
  return std::string(fifo_priority ? "SCHED_FIFO" : "ordinary scheduling") +
         (locked_memory ? ", memory locked" : ", memory not locked");
}

}  // namespace photocoag
