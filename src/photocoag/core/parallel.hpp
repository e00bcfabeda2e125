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

/// As many threads as are asked for; 0: as there are cores.
inline unsigned thread_count(unsigned asked = 0) {
  return asked > 0 ? asked : std::max(1U, std::thread::hardware_concurrency());
}

/// Threads that make a result of every item. After a failure no further item is begun. The
/// destructor lets those that are begun end, and leaves out the rest.
template <typename Item, typename Result>
class Workers {
 public:
  /// `make_worker()` is called once on each thread, its answer with one item after the other.
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
  /// Forgets what no thread has begun.
  void clear() {
    const std::lock_guard lock(mutex_);
    waiting_.clear();
  }
  std::size_t waiting() {
    const std::lock_guard lock(mutex_);
    return waiting_.size();
  }
  /// Nothing waits, is under way or is to be taken.
  bool idle() {
    const std::lock_guard lock(mutex_);
    return waiting_.empty() && busy_ == 0 && finished_.empty();
  }
  /// What has become finished since. Throws the first failure again.
  std::vector<Result> take() {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    return std::exchange(finished_, {});
  }
  /// take(), as soon as there is something to take; at once if nothing is under way.
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

/// task(0), ..., task(count - 1), each once, in any order, on as many threads as there are cores.
/// The first exception is thrown again after all threads have ended; tasks not yet begun are left
/// out. `progress(done)` is told on the calling thread how many have ended, `count` last.
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
