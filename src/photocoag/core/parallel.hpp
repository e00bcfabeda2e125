// Role: setup; independent tasks on all cores. Used by run, study, session, certify. Real time:
// none; starts threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace photocoag {

/// task(0), ..., task(count - 1), each once, in any order, on as many threads as there are cores.
/// The first exception is thrown again after all threads have ended; tasks not yet begun are left
/// out. `progress(done)` is told on the calling thread how many have ended, `count` last.
void for_each_in_parallel(std::size_t count, const auto& task, const auto& progress) {
  std::atomic<std::size_t> next{0};
  std::atomic<std::size_t> done{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto work = [&](const auto& tell) {
    try {
      for (std::size_t i = next++; i < count; i = next++) {
        task(i);
        tell(++done);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  std::vector<std::thread> others;
  for (unsigned n = 1; n < std::max(1U, std::thread::hardware_concurrency()); ++n) {
    others.emplace_back([&work] { work([](std::size_t) {}); });
  }
  work(progress);
  for (std::thread& other : others) other.join();
  if (failure) std::rethrow_exception(failure);
  progress(count);
}

void for_each_in_parallel(std::size_t count, const auto& task) {
  for_each_in_parallel(count, task, [](std::size_t) {});
}

}  // namespace photocoag
