// Role: offline; the figures of one run. Used by report.
// Source: the paper's closed-loop figures: peak temperature, volume temperature, control, alpha.
// Units: K, mW, ms. Real-time promise: none. Threads: none.
#pragma once

#include <vector>

#include "photocoag/page/figure.hpp"
#include "photocoag/report/run_log.hpp"

namespace photocoag {

/// Part of the run.
struct RunView {
  double from_ms = 0.0;
  double to_ms = 0.0;
};

/// Figures with one panel each, over the same time axis: temperatures, power, estimated factors.
/// Precondition: the log is not empty.
std::vector<Figure> run_figures(const RunLog& log, const RunSummary& summary,
                                const RunConfig& config, const RunView& view);

}  // namespace photocoag
