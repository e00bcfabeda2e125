#include "photocoag/eye/eye_statistics.hpp"

#include <fmt/format.h>

#include <iterator>
#include <numeric>

namespace photocoag {

std::string to_text(const EyeStatistics& s) {
  std::string text = fmt::format(
      "eye       {} pulses, {} answered late, {} dark by the watchdog or the interlock; {}\n"
      "work      per pulse: median {:g} us, 99 % {:g} us, 99.9 % {:g} us, largest {:.1f} us\n"
      "answer    after its pulse was due: median {:g} us, 99 % {:g} us, largest {:.1f} us\n"
      "peak      at most {:.2f} K as mean over a pulse period, {:.2f} K right after a pulse\n",
      s.pulses, s.late, s.watchdog, s.scheduling, s.work.quantile_us(0.5), s.work.quantile_us(0.99),
      s.work.quantile_us(0.999), s.work.max_us(), s.answer.quantile_us(0.5),
      s.answer.quantile_us(0.99), s.answer.max_us(), s.peak_mean_max, s.peak_pulse_max);
  if (s.refused > 0) {
    fmt::format_to(std::back_inserter(text), "refused   {} commands beyond {:g} W: 0 W instead\n",
                   s.refused, s.power_max);
  }
  if (s.lockstep > 0) {
    fmt::format_to(
        std::back_inserter(text),
        "lockstep  {} of these pulses waited for the controller: not late by any clock\n",
        s.lockstep);
  }
  constexpr std::size_t kWidth = 10;  // us per line
  const auto line = [&text](std::size_t first, const std::string& to, std::uint64_t count) {
    if (count == 0) return;
    fmt::format_to(std::back_inserter(text), "          {:>4} us {} {:>9}\n", first, to, count);
  };
  const auto begin = s.work.bins().begin();
  for (std::size_t first = 0; first < EyeStatistics::kBins; first += kWidth) {
    const auto from = begin + static_cast<std::ptrdiff_t>(first);
    line(first, fmt::format("to {:>4} us", first + kWidth),
         std::accumulate(from, from + kWidth, std::uint64_t{0}));
  }
  line(EyeStatistics::kBins, "and more", s.work.overflow());
  return text;
}

}  // namespace photocoag
