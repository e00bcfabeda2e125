#include "photocoag/core/stop_signal.hpp"

namespace photocoag {
namespace {

std::atomic<bool> requested{false};
std::atomic<int> requests{0};
// May be set in a signal handler.
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

void request_stop(int) {
  requests.fetch_add(1);
  requested.store(true);
}

}  // namespace

void stop_on_signals(std::initializer_list<int> signals) noexcept {
  struct sigaction action {};
  action.sa_handler = request_stop;
  for (const int signal : signals) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
  }
}

const std::atomic<bool>& stop_requested() noexcept { return requested; }

void ask_to_stop() noexcept { requested.store(true, std::memory_order_relaxed); }

void forget_stop() noexcept {
  requested.store(false);
  if (requests.load() > 0) requested.store(true);  // a signal's request stays
}

int stop_requests() noexcept { return requests.load(std::memory_order_relaxed); }

}  // namespace photocoag
