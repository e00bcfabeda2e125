// Role: offline; the paper's table of computation times, on this machine. Used by reproduce.
// Source: paper, table of computation times (section 3). Difference: the clock runs over condensing
// and solving, i.e. from the estimate to the power; the paper does not say what its times include.
// Units: us. Real-time promise: none.
#pragma once

#include <vector>

#include "photocoag/study/run_set.hpp"
#include "photocoag/study/study.hpp"

namespace photocoag {

/// One run per horizon: ids dense_n2, dense_n5, …; one value per treatment, each treatment replayed
/// five times: solve_mean_us and solve_max_us over all solves, the machine's interruptions
/// included; solve_worst_us, the largest over the cycles of the least time of the same solve, which
/// leaves them out; solve_first_us and solve_warm_worst_us, the same of the first solve and of all
/// others. Horizons interleaved, so that a noisy moment hits all alike.
std::vector<RunResult> time_solvers(const Study& study, int treatments, ModelPool& pool);

/// The paper's figures, ms; NaN for a horizon that it has not.
struct PaperTime {
  double average_ms;
  double maximum_ms;
};
PaperTime paper_time(int horizon);

}  // namespace photocoag
