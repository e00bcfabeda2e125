#include "photocoag/rt/real_time.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

namespace photocoag {

RealTime request_real_time() noexcept {
  constexpr int kPriority = 60;  // above ordinary interrupts' threads, below the kernel's watchdogs
  RealTime granted;
  const sched_param parameters{.sched_priority = kPriority};
  granted.fifo_priority = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
  granted.locked_memory = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  return granted;
}

std::string RealTime::describe() const {
  return std::string(fifo_priority ? "SCHED_FIFO" : "ordinary scheduling") +
         (locked_memory ? ", memory locked" : ", memory not locked");
}

}  // namespace photocoag
