// Role: offline; one sentence about a run. Used by report, apps.
// Units: K, ms in words. Real-time promise: none. Threads: none.
#pragma once

#include <string>
#include <vector>

#include "photocoag/report/run_log.hpp"

namespace photocoag {

struct Verdict {
  std::string symbol;  ///< one character, so that the verdict does not rely on colour alone
  std::string name;    ///< "Held", "Not held", "Not reached", "Limit exceeded", "Stopped"
  std::string text;    ///< one sentence with the decisive numbers
  bool alarm = false;  ///< the limit was exceeded or the treatment was stopped
};

/// Held: never stopped, no cycle over the limit, 95 % of the reference reached, and an RMS error
/// after 50 ms (if known) of at most 5 % of the reference. Without a true peak the estimate
/// decides, and the sentence says so.
Verdict judge(const RunLog& log, const RunSummary& summary, const RunConfig& config);

/// K: the peak that `control.robust = "chance"` allows given the estimate at the end of a cycle:
/// limit * e^(-kappa sigma / estimate). NaN without it.
double chance_aim(const RunLog& log, const RunSummary& summary, std::size_t cycle);

/// Sentences for every number of summary.json that run.csv contradicts; empty if they agree.
std::vector<std::string> contradictions(const RunLog& log, const RunSummary& summary);

/// `value` with enough digits (at least one) to show on which side of `limit` it is.
std::string decisive(double value, double limit);

}  // namespace photocoag
