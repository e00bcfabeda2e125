#include "photocoag/eye/eye_statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace photocoag {

void Histogram::add(std::int64_t ns) noexcept {
  const std::int64_t us = std::max<std::int64_t>(ns, 0) / 1000;
  ++bins_[std::min(static_cast<std::size_t>(us), kBins - 1)];
  ++count_;
  max_ns_ = std::max(max_ns_, ns);
}

double Histogram::percentile_us(double fraction) const noexcept {
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    below += bins_[i];
    if (static_cast<double>(below) >= fraction * static_cast<double>(count_)) {
      return static_cast<double>(i + 1);
    }
  }
  return static_cast<double>(kBins);
}

std::string to_text(const EyeStatistics& s) {
  std::string text = fmt::format(
      "eye       {} pulses, {} answered late, {} dark by the watchdog or the interlock; {}\n"
      "work      per pulse: median {:g} us, 99 % {:g} us, 99.9 % {:g} us, largest {:.1f} us\n"
      "answer    after its pulse was due: median {:g} us, 99 % {:g} us, largest {:.1f} us\n"
      "peak      at most {:.2f} K as mean over a pulse period, {:.2f} K right after a pulse\n",
      s.pulses, s.late, s.watchdog, s.scheduling, s.work.percentile_us(0.5),
      s.work.percentile_us(0.99), s.work.percentile_us(0.999), s.work.max_us(),
      s.answer.percentile_us(0.5), s.answer.percentile_us(0.99), s.answer.max_us(), s.peak_mean_max,
      s.peak_pulse_max);
  constexpr std::size_t kWidth = 10;  // us per line
  for (std::size_t first = 0; first < Histogram::kBins; first += kWidth) {
    std::uint64_t count = 0;
    for (std::size_t i = first; i < first + kWidth; ++i) count += s.work.bin(i);
    if (count == 0) continue;
    const bool last = first + kWidth == Histogram::kBins;
    fmt::format_to(std::back_inserter(text), "          {:>4} us {} {:>9}\n", first,
                   last ? "and more" : fmt::format("to {:>4} us", first + kWidth), count);
  }
  return text;
}

}  // namespace photocoag
