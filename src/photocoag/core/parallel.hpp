// Role: setup; independent tasks on all cores. Used by run, population, study, session, certify,
// campaign, the Python package. Real time: none; starts threads.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace photocoag {

/// `asked` threads; 0: one per core.
inline unsigned thread_count(unsigned asked = 0) {
  return asked > 0 ? asked : std::max(1U, std::thread::hardware_concurrency());
}

/// A thread pool that turns items into results. After a failure no further item is started. The
/// destructor waits for started items and drops the rest.
template <typename Item, typename Result>
class Workers {
 public:
  /// `make_worker()` is called once per thread; the function it returns is then called per item.
  template <typename MakeWorker>
  Workers(unsigned threads, MakeWorker make_worker) {
    try {
      for (unsigned i = 0; i < threads; ++i) {
        threads_.emplace_back([this, make_worker] { work(make_worker); });
      }
    } catch (...) {
      end();
      throw;
    }
  }
  ~Workers() { end(); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  void add(Item item) {
    {
      const std::lock_guard lock(mutex_);
      if (failure_) return;
      waiting_.push_back(std::move(item));
    }
    wake_.notify_one();
  }
  /// Drops the items that no thread has started.
  void clear() {
    const std::lock_guard lock(mutex_);
    waiting_.clear();
  }
  std::size_t waiting() {
    const std::lock_guard lock(mutex_);
    return waiting_.size();
  }
  /// True if nothing is waiting, running or ready to take.
  bool idle() {
    const std::lock_guard lock(mutex_);
    return waiting_.empty() && busy_ == 0 && finished_.empty();
  }
  /// Results finished since the last call. Rethrows the first failure.
  std::vector<Result> take() {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    return std::exchange(finished_, {});
  }
  /// Blocks until there is something to take, then take(); returns at once if nothing is running.
  std::vector<Result> wait() {
    {
      std::unique_lock lock(mutex_);
      result_.wait(lock, [this] {
        return failure_ || !finished_.empty() || (waiting_.empty() && busy_ == 0);
      });
    }
    return take();
  }

 private:
  void end() {
    {
      const std::lock_guard lock(mutex_);
      waiting_.clear();
      ended_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  template <typename MakeWorker>
  void work(const MakeWorker& make_worker) {
    std::unique_lock lock(mutex_, std::defer_lock);
    try {
      auto worker = make_worker();
      lock.lock();
      while (true) {
        wake_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
        if (ended_) return;
        Item item = std::move(waiting_.front());
        waiting_.pop_front();
        ++busy_;
        lock.unlock();
        Result result = worker(item);
        lock.lock();
        finished_.push_back(std::move(result));
        --busy_;
        result_.notify_one();
      }
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      if (!failure_) failure_ = std::current_exception();
      waiting_.clear();
      result_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable result_;
  std::deque<Item> waiting_;
  std::vector<Result> finished_;
  std::size_t busy_ = 0;
  bool ended_ = false;
  std::exception_ptr failure_;
  std::vector<std::thread> threads_;
};

/// task(0), ..., task(count - 1), each once, in any order, on one thread per core. The first
/// exception is rethrown after all threads have ended; tasks not yet started are dropped.
/// `progress(done)` runs on the calling thread, last with `count`.
void for_each_in_parallel(std::size_t count, const auto& task, const auto& progress) {
  const auto threads = static_cast<unsigned>(std::min<std::size_t>(thread_count(), count));
  Workers<std::size_t, std::size_t> workers(threads, [&task] {
    return [&task](std::size_t i) {
      task(i);
      return i;
    };
  });
  for (std::size_t i = 0; i < count; ++i) workers.add(i);
  for (std::size_t done = 0; done < count;) progress(done += workers.wait().size());
  progress(count);
}

void for_each_in_parallel(std::size_t count, const auto& task) {
  for_each_in_parallel(count, task, [](std::size_t) {});
}

}  // namespace photocoag
