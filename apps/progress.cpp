#include "progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "console.hpp"

namespace photocoag {
namespace {

// Returns to the start of the line and clears it.
void start_line() { std::fputs("\r\033[K", stderr); }

bool on_terminal() {
  static const bool terminal = isatty(STDERR_FILENO) == 1;
  return terminal;
}

}  // namespace

void draw_progress(std::string_view label, double fraction, std::string_view detail) {
  if (!on_terminal()) return;
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * kWidth);
  start_line();
  say("{:<9} [{:<{}}] {:3.0f} %  {}", label, std::string(filled, '='), kWidth, fraction * 100.0,
      detail);
  std::fflush(stderr);
}

void clear_progress() {
  if (on_terminal()) start_line();
}

Progress progress_bar(std::string label) {
  return
      [label](std::string_view stage, double fraction) { draw_progress(label, fraction, stage); };
}

ProgressMeter::ProgressMeter(std::string label, const std::atomic<std::size_t>& done,
                             std::size_t total)
    : thread_([this, label = std::move(label), &done, total] {
        while (!finished_.load(std::memory_order_relaxed)) {
          const std::size_t now = done.load(std::memory_order_relaxed);
          draw_progress(label, static_cast<double>(now) / static_cast<double>(total),
                        fmt::format("{} of {} cycles, Ctrl-C: 0 W", now, total));
          std::this_thread::sleep_for(std::chrono::milliseconds(100));
        }
      }) {}

ProgressMeter::~ProgressMeter() {
  finished_.store(true, std::memory_order_relaxed);
  thread_.join();
  clear_progress();
}

}  // namespace photocoag
