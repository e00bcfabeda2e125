// Role: offline; the paper's table of computation times, on this machine. Used by reproduce.
// Source: paper, table of computation times (section 3). Difference: the clock runs over condensing
// and solving, i.e. from the estimate to the power; the paper does not say what its times include.
// Units: us. Real-time promise: none.
#pragma once

#include <vector>

#include "photocoag/study/run_set.hpp"
#include "photocoag/study/study.hpp"

namespace photocoag {

/// One run per horizon: ids dense_n2, dense_n5, …; measures solve_mean_us, solve_max_us,
/// solve_first_us, solve_warm_max_us (the first solve left out), one value per treatment. Horizons
/// interleaved, so that a noisy moment hits all alike.
std::vector<RunResult> time_solvers(const Study& study, int treatments, ModelPool& pool);

/// The paper's figures, ms; NaN for a horizon that it has not.
struct PaperTime {
  double average_ms;
  double maximum_ms;
};
PaperTime paper_time(int horizon);

}  // namespace photocoag
