// Role: everywhere; the wish to stop, from outside the program. Used by the commands, process.cpp.
// Real-time promise: reading is one atomic load.
#pragma once

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace photocoag {

/// From now on these signals ask to stop instead of ending the program. One that the caller has
/// the program ignore (nohup) stays ignored. May be called again.
void stop_on_signals(std::initializer_list<int> signals = {SIGINT, SIGTERM, SIGHUP}) noexcept;

/// True once any of them has come.
const std::atomic<bool>& stop_requested() noexcept;

/// How many have come.
int stop_requests() noexcept;

/// A wish without a signal, from any thread; it counts as none that has come.
void ask_to_stop() noexcept;
/// Takes such a wish back; not that of a signal.
void forget_stop() noexcept;

}  // namespace photocoag
