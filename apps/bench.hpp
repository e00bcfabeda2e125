// Role: the program; common parts of the benchmarks: clock, percentiles, JSON. Times in
// microseconds.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "photocoag/core/percentile.hpp"
#include "photocoag/core/thread_clock.hpp"

namespace photocoag {

struct BenchOptions {
  std::string name;              ///< cycle, qp, first-cycle
  std::string config;            ///< cycle: an additional row for this file …
  std::vector<std::string> set;  ///< … with these overrides
  std::string json;              ///< file; - is standard output
  std::string svg;               ///< qp: figure
  std::string problems;          ///< qp: the recorded problems, JSON
  int repetitions = 10;          ///< qp: of every step
  bool one_process = false;      ///< first-cycle: measure in this process, print one number
};

using Json = nlohmann::ordered_json;

/// Cost of reading a clock, us: median of 10,000.
double reading_us(double (*clock_us)());

/// Cost of reading the thread's CPU clock, us, measured once.
double thread_clock_us();

/// CPU time of the thread since `begin`, us, without the cost of reading the clock.
inline double spent_us(double begin) {
  return std::max(0.0, thread_us() - begin - thread_clock_us());
}

/// To the file of --json, if there is one.
void write_json(const BenchOptions& options, const Json& json);

int bench_cycle(const BenchOptions& options);
int bench_qp(const BenchOptions& options);
int bench_first_cycle(const BenchOptions& options);

}  // namespace photocoag
