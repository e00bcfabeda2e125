// Role: the program; progress bars on a terminal, nothing elsewhere.
#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <string_view>
#include <thread>

#include "photocoag/core/progress.hpp"

namespace photocoag {

/// Draws "label [=====     ] 52 %  detail" on standard error if that is a terminal; erases it with
/// clear().
void draw_progress(std::string_view label, double fraction, std::string_view detail = {});
void clear_progress();

/// Progress callback that draws the stages of a computation under one label.
Progress progress_bar(std::string label);

/// Draws the bar from a counter that another thread advances, ten times a second, until destroyed.
class ProgressMeter {
 public:
  ProgressMeter(std::string label, const std::atomic<std::size_t>& done, std::size_t total);
  ~ProgressMeter();
  ProgressMeter(const ProgressMeter&) = delete;
  ProgressMeter& operator=(const ProgressMeter&) = delete;

 private:
  std::atomic<bool> finished_{false};
  std::thread thread_;
};

}  // namespace photocoag
