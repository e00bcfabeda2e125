// Role: offline; parameter sweeps over all combinations of values of configuration keys, and
// comparison of finished runs. Used by `photocoag sweep` and `photocoag compare`.
// Units: in the names. Real-time promise: none.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/study/run_set.hpp"

namespace photocoag {

/// One --vary: a key and the values it takes.
struct Varied {
  std::string key;
  std::vector<std::string> values;
};

/// "key=v1,v2,…"; commas inside brackets, braces and quotes do not separate. Throws Error.
Varied parse_varied(const std::string& option);

struct SweepPoint {
  std::vector<std::string> values;  ///< one per Varied
  RunResult result;
};

/// All combinations in the order of the options, the last one fastest; at most 10,000. Every
/// configuration is checked before the first runs. Throws Error.
std::vector<SweepPoint> sweep(const std::string& config, const std::vector<std::string>& set,
                              const std::vector<Varied>& varied, int seeds, bool use_cache,
                              const Progress& progress = {});

/// The columns of the table, as (measure, statistic over the seeds).
const std::vector<std::pair<std::string, std::string>>& sweep_columns();

/// sweep.csv, sweep.svg (the first 18 combinations) and index.html in `folder`, new or empty.
void write_sweep(const std::filesystem::path& folder, const std::vector<Varied>& varied,
                 const std::vector<SweepPoint>& points, int seeds);

/// index.html, compare.svg and compare.csv of run folders in `out`, new or empty: one time axis, a
/// table of their summaries, and the keys in which their configurations differ. Throws Error.
void compare_runs(const std::vector<std::filesystem::path>& runs, const std::filesystem::path& out);

}  // namespace photocoag
