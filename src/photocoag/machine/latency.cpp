#include "photocoag/machine/latency.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <thread>

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
  CyclictestRun run{.command = fmt::format("cyclictest -q -m -t 1 -p 60 -i {} -l {} -h {}",
                                           std::llround(period * 1e6),
                                           std::llround(seconds / period),
                                           std::llround(2e6 * period)),
                    .why_not = {},
                    .histogram = DurationHistogram(period)};
  std::FILE* pipe = popen((run.command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) {
    run.why_not = "no shell";
    return run;
  }
  std::string output;
  std::array<char, 4096> buffer{};
  for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    output.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  run.histogram = parse_cyclictest(output, period);
  run.ran = status == 0 && run.histogram.counted() > 0;
  if (!run.ran) {
    run.why_not = output.find("not found") != std::string::npos
                      ? "not installed (Debian: rt-tests)"
                      : output.substr(0, output.find('\n'));
  }
  return run;
}

}  // namespace photocoag
