#include "photocoag/rt/last_resort.hpp"

#include <cfenv>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <initializer_list>

namespace photocoag {
namespace {

void (*last_off)(void*) noexcept = nullptr;
void* last_device = nullptr;

[[noreturn]] void switch_off_and_abort() noexcept {
  if (last_off != nullptr) last_off(last_device);
  std::abort();
}

// The handler is gone by now: a second fault, in `off`, ends the program at once.
void switch_off_and_die(int signal) {
  std::fesetenv(FE_DFL_ENV);  // no traps in what follows
  if (last_off != nullptr) last_off(last_device);
  std::raise(signal);
}

void handle_unless_handled(int signal) noexcept {
  struct sigaction present {};
  if (sigaction(signal, nullptr, &present) != 0 || present.sa_handler != SIG_DFL) return;
  struct sigaction action {};
  action.sa_handler = switch_off_and_die;
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_NODEFER);
  sigaction(signal, &action, nullptr);
}

}  // namespace

void set_last_resort(void (*off)(void* device) noexcept, void* device) noexcept {
  last_off = off;
  last_device = device;
  std::set_terminate(switch_off_and_abort);
  for (const int signal : {SIGFPE, SIGSEGV, SIGBUS, SIGILL, SIGABRT}) handle_unless_handled(signal);
}

}  // namespace photocoag
