// `photocoag doctor` and `photocoag latency`: is this machine fit for real time?
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "commands.hpp"
#include "console.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/realtime_check/doctor.hpp"
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

}  // namespace

int doctor_command(const DoctorOptions& options) {
  const std::vector<Finding> findings = examine(own_privileges());
  Json json = Json::array();
  const bool table = options.json != "-";
  bool bad = false;
  for (const Finding& finding : findings) {
    bad = bad || finding.health == Health::kBad;
    json.push_back({{"topic", finding.topic},
                    {"health", to_string(finding.health)},
                    {"found", finding.found},
                    {"advice", finding.advice}});
    if (!table) continue;
    print("{:<4}  {:<21} {}\n", to_string(finding.health), finding.topic, finding.found);
    if (!finding.advice.empty()) print("{:29}{}\n", "", finding.advice);
  }
  write_output(options.json, json.dump(2) + "\n");
  return bad ? 1 : 0;
}

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

}  // namespace photocoag
