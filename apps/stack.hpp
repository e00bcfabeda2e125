// Role: the program; ensures enough stack whatever the caller's limit (ulimit -s). Used by
// main.cpp.
#pragma once

#include <pthread.h>
#include <sys/resource.h>

#include <exception>
#include <thread>

namespace photocoag {

/// Calls `command` and returns what it returns. If the limit is below the usual 8 MiB, every thread
/// gets 8 MiB and the command runs on a thread: controllers and models live on the stack.
template <typename Command>
int with_usual_stack(const Command& command) {
  constexpr rlim_t kUsual = 8U << 20U;  // bytes
  rlimit granted{};
  if (getrlimit(RLIMIT_STACK, &granted) != 0 || granted.rlim_cur >= kUsual) return command();
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, kUsual);
  pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
  int exit_code = 0;
  std::exception_ptr trouble;
  std::thread([&] {
    try {
      exit_code = command();
    } catch (...) {
      trouble = std::current_exception();
    }
  }).join();
  if (trouble) std::rethrow_exception(trouble);
  return exit_code;
}

}  // namespace photocoag
