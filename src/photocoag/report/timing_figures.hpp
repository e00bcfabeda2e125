// Role: offline; histograms of the cycles' durations. Used by report.
// Source: docs/realtime.md, "Where the time went". Units: as in the names (us, shown as µs).
// Real-time promise: none. Threads: none.
#pragma once

#include <vector>

#include "photocoag/page/figure.hpp"
#include "photocoag/report/run_log.hpp"

namespace photocoag {

/// One figure per histogram that has an entry in a bin: cycles over the duration, logarithmic
/// counts, so that one late cycle in a million is visible. Neighbouring bins are merged to about 80
/// columns; the title says how wide they are, and how many entries lie below 0 or above all bins.
/// Test: tests/report/timing_figures_test.cpp.
std::vector<Figure> timing_figures(const std::vector<RunSummary::Histogram>& histograms);

}  // namespace photocoag
