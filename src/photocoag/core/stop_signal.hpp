// Role: everywhere; stop requests from outside the program. Used by the commands, fault_table,
// process.cpp.
// Real-time promise: reading is one atomic load.
#pragma once

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace photocoag {

/// From now on these signals request a stop instead of ending the program. A signal that is already
/// ignored (nohup) stays ignored. May be called again.
void stop_on_signals(std::initializer_list<int> signals = {SIGINT, SIGTERM, SIGHUP}) noexcept;

/// True once a stop has been requested.
const std::atomic<bool>& stop_requested() noexcept;

/// Number of signals received.
int stop_requests() noexcept;

/// Requests a stop without a signal, from any thread; not counted by stop_requests().
void ask_to_stop() noexcept;
/// Withdraws ask_to_stop(); a signal's request stays.
void forget_stop() noexcept;

}  // namespace photocoag
