#include "photocoag/realtime_check/latency.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <thread>

#include "photocoag/core/error.hpp"
#include "photocoag/core/process.hpp"
#include "photocoag/rt/clock.hpp"
#include "photocoag/rt/real_time.hpp"

namespace photocoag {

WakeLatency measure_wake_latency(double seconds, double period, const std::atomic<bool>& stop) {
  WakeLatency result{.histogram = DurationHistogram(period), .scheduling = {}};
  const auto period_ns = static_cast<std::int64_t>(period * 1e9 + 0.5);
  const auto wakes = static_cast<std::int64_t>(std::llround(seconds / period));
  RealTime granted;
  std::thread([&] {
    granted = request_real_time();
    std::int64_t deadline = monotonic_ns() + period_ns;
    for (std::int64_t k = 0; k < wakes && !stop.load(std::memory_order_relaxed); ++k) {
      wait_until(deadline);
      const std::int64_t late = monotonic_ns() - deadline;
      result.histogram.add(late);
      const std::int64_t missed = late / period_ns;
      result.whole_periods_missed += static_cast<std::uint64_t>(missed);
      k += missed;
      deadline += (1 + missed) * period_ns;
    }
  }).join();
  result.scheduling = granted.describe();
  return result;
}

DurationHistogram parse_cyclictest(std::string_view output, double period) {
  DurationHistogram histogram(period);
  constexpr std::string_view kOverflows = "# Histogram Overflows:";
  for (std::size_t at = 0; at < output.size();) {
    const std::size_t end = std::min(output.find('\n', at), output.size());
    const std::string_view line = output.substr(at, end - at);
    at = end + 1;
    const auto number = [&line](std::size_t from, std::int64_t& value) {
      from = std::min(line.find_first_not_of(" \t", from), line.size());
      const auto [rest, error] =
          std::from_chars(line.data() + from, line.data() + line.size(), value);
      return error == std::errc() ? static_cast<std::size_t>(rest - line.data()) : 0;
    };
    std::int64_t latency = 0;
    std::int64_t count = 0;
    if (line.starts_with(kOverflows)) {
      number(kOverflows.size(), count);
      latency = static_cast<std::int64_t>(histogram.bins().size());  // above all bins
    } else {
      const std::size_t rest = number(0, latency);
      if (rest == 0 || number(rest, count) == 0) continue;
    }
    for (std::int64_t k = 0; k < count; ++k) histogram.add(latency * 1000);
  }
  return histogram;
}

CyclictestRun run_cyclictest(double seconds, double period) {
  constexpr double kStart = 30.0;  // s, for starting and ending
  CyclictestRun run{.histogram = DurationHistogram(period)};
  const auto number = [](double value) { return std::to_string(std::llround(value)); };
  try {
    const ProgramResult result =
        run_program({"cyclictest", "-q", "-m", "-t", "1", "-p", "60", "-i", number(period * 1e6),
                     "-l", number(seconds / period), "-h", number(2e6 * period)},
                    {.patience = seconds + kStart});
    run.histogram = parse_cyclictest(result.output, period);
    run.ran = result.exit_code == 0 && run.histogram.counted() > 0;
    const std::string said = result.errors + result.output;
    if (!result.found) {
      run.why_not = "not installed (Debian: rt-tests)";
    } else if (!run.ran) {
      run.why_not = said.substr(0, said.find('\n'));
    }
  } catch (const Error& error) {
    run.why_not = error.what();
  }
  return run;
}

}  // namespace photocoag
