// `photocoag latency`: how late a real-time thread wakes.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>

#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/realtime_check/latency.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFractions[] = {0.5, 0.9, 0.99, 0.999, 0.9999};

Json percentiles(const DurationHistogram& histogram) {
  Json json = {{"wakes", histogram.counted()}, {"min_us", histogram.min_us()}};
  for (const double fraction : kFractions) {
    json[fmt::format("p{:g}_us", 100.0 * fraction)] = histogram.quantile_us(fraction);
  }
  json["max_us"] = histogram.max_us();
  return json;
}

void print_row(std::string_view name, const DurationHistogram& histogram) {
  print("{:<11} {:>9} {:>8.1f}", name, histogram.counted(), histogram.min_us());
  for (const double fraction : kFractions) {
    print(" {:>8.1f}", histogram.quantile_us(fraction));
  }
  print(" {:>8.1f}\n", histogram.max_us());
}

struct LatencyOptions {
  double seconds = 10.0;
  double period_ms = 1.0;
  std::string json;  ///< file; - is standard output
};

int latency_command(const LatencyOptions& options) {
  const double period = options.period_ms * 1e-3;
  stop_on_signals();
  CyclictestRun other;
  std::thread beside([&] { other = run_cyclictest(options.seconds, period); });
  const WakeLatency own = measure_wake_latency(options.seconds, period, stop_requested());
  beside.join();
  Json json = {{"period_ms", options.period_ms},
               {"seconds", options.seconds},
               {"scheduling", own.scheduling},
               {"photocoag", percentiles(own.histogram)}};
  json["photocoag"]["periods_missed"] = own.whole_periods_missed;
  json["cyclictest"] = other.ran ? percentiles(other.histogram) : Json();
  if (options.json != "-") {
    print("wake-up after the deadline in us; {} ms, {}\n", options.period_ms, own.scheduling);
    print("{:<11} {:>9} {:>8}", "", "wakes", "min");
    for (const double fraction : kFractions) {
      print(" {:>8}", fmt::format("p{:g}", 100.0 * fraction));
    }
    print(" {:>8}\n", "max");
    print_row("photocoag", own.histogram);
    if (other.ran) {
      print_row("cyclictest", other.histogram);
    } else {
      print("cyclictest  not run: {}\n", other.why_not);
    }
    print("{} whole periods missed\n", own.whole_periods_missed);
  }
  write_output(options.json, json.dump(2) + "\n");
  return 0;
}

const Command kLatency(
    "latency", "measure how late this machine wakes a real-time thread, next to cyclictest",
    latency_command, [](CommandLine& command, LatencyOptions& options) {
      command.add_option("--seconds", options.seconds, "how long to measure")
          .check(number_from(0.01, 1e6))
          .type_name("S");
      command.add_option("--period-ms", options.period_ms, "from deadline to deadline")
          .check(number_from(0.05, 100.0))
          .type_name("T");
      command
          .add_option("--json", options.json,
                      "also write it as JSON; -: only that, on standard output")
          .type_name("FILE");
      command.footer(
          footer("  photocoag latency --seconds 60\n"
                 "  photocoag latency --seconds 10 --period-ms 0.1\n"
                 "If cyclictest (Debian: rt-tests) is installed it runs at the same time."));
    });

}  // namespace

}  // namespace photocoag
