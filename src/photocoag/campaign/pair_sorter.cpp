#include "photocoag/campaign/pair_sorter.hpp"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <utility>

namespace photocoag {
namespace {

constexpr std::size_t kLeastBuffer = 64;  // pairs of a run that are read at a time

[[noreturn]] void fail(const std::filesystem::path& folder, const std::string& what) {
  fail_by_errno(folder.string(), "a temporary file " + what);
}

}  // namespace

PairSorter::PairSorter(std::filesystem::path folder, std::size_t in_memory)
    : folder_(std::move(folder)), in_memory_(in_memory) {}

void PairSorter::add(KeyedValue pair) {
  if (pairs_.size() == in_memory_) write_run();
  pairs_.push_back(pair);
}

void PairSorter::write_run() {
  std::sort(pairs_.begin(), pairs_.end());
  if (!file_.open()) {
    std::string name = (folder_ / ".photocoag-XXXXXX").string();
    file_ = Descriptor(mkostemp(name.data(), O_CLOEXEC));
    if (!file_.open()) fail(folder_, "cannot be made");
    unlink(name.c_str());
  }
  if (!file_.write(pairs_.data(), pairs_.size() * sizeof(KeyedValue))) {
    fail(folder_, "cannot be written");
  }
  ends_.push_back((ends_.empty() ? 0 : ends_.back()) + pairs_.size());
  pairs_.clear();
}

void PairSorter::finish() {
  if (!file_.open()) {
    std::sort(pairs_.begin(), pairs_.end());
    return;
  }
  write_run();
  pairs_.shrink_to_fit();
}

PairSorter::Cursor::Cursor(const PairSorter& sorter) : sorter_(sorter) {
  const std::size_t count = sorter.ends_.size();
  if (count == 0) return;
  buffer_ = std::max(kLeastBuffer, sorter.in_memory_ / count);
  runs_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    runs_[i].at = i == 0 ? 0 : sorter.ends_[i - 1];
    runs_[i].end = sorter.ends_[i];
    if (fill(runs_[i])) heap_.push_back(i);
  }
  std::make_heap(heap_.begin(), heap_.end(), [this](std::size_t a, std::size_t b) {
    return runs_[a].buffer[0] > runs_[b].buffer[0];
  });
}

bool PairSorter::Cursor::fill(Run& run) const {
  const auto pairs = static_cast<std::size_t>(std::min<std::uint64_t>(buffer_, run.end - run.at));
  run.buffer.resize(pairs);
  run.next = 0;
  const std::size_t bytes = pairs * sizeof(KeyedValue);
  if (!sorter_.file_.read_all_at(run.buffer.data(), bytes, run.at * sizeof(KeyedValue))) {
    fail(sorter_.folder_, "cannot be read");
  }
  run.at += pairs;
  return pairs > 0;
}

bool PairSorter::Cursor::next(KeyedValue& pair) {
  if (runs_.empty()) {
    if (at_ == sorter_.pairs_.size()) return false;
    pair = sorter_.pairs_[at_++];
    return true;
  }
  if (heap_.empty()) return false;
  const auto later = [this](std::size_t a, std::size_t b) {
    return runs_[a].buffer[runs_[a].next] > runs_[b].buffer[runs_[b].next];
  };
  std::pop_heap(heap_.begin(), heap_.end(), later);
  Run& run = runs_[heap_.back()];
  pair = run.buffer[run.next++];
  if (run.next < run.buffer.size() || fill(run)) {
    std::push_heap(heap_.begin(), heap_.end(), later);
  } else {
    heap_.pop_back();
  }
  return true;
}

}  // namespace photocoag
