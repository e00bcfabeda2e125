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
/// included; solve_worst_us, the largest over the cycles of each solve's minimum over the replays,
/// which excludes them; solve_first_us and solve_warm_worst_us, the same for the first solve and
/// for all others. Horizons are interleaved, so that disturbances affect all alike.
std::vector<RunResult> time_solvers(const Study& study, int treatments, ModelPool& pool);

/// The paper's times, ms; NaN for horizons not in the paper.
struct PaperTime {
  double average_ms;
  double maximum_ms;
};
PaperTime paper_time(int horizon);

}  // namespace photocoag
