// Role: offline; the predicates of the studies' files, e.g.
//   "max(peak_max_K, a_high) <= 32 and median(time_to_95_ms, a_high) < 30"
// Used by study. Grammar: comparisons joined by `and`; sums, products, numbers, parentheses, and
// calls STATISTIC(MEASURE, RUN) or STATISTIC(MEASURE, RUN, OTHER_RUN); statistics over the seeds:
// min, max, mean, median, std. Units: those of the measure's name. Real-time promise: none.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace photocoag {

/// One call of a predicate.
struct Term {
  std::string statistic;  ///< min, max, mean, median or std
  std::string measure;    ///< with unit, e.g. "peak_max_K"
  std::string run;
  std::string other;  ///< of a difference of two runs; else empty

  std::string text() const;
};

/// The values of a measure, one per seed. Throws Error if there is no such run or measure.
using MeasureSource = std::function<std::vector<double>(const Term&)>;

struct TermValue {
  Term term;
  double value = 0.0;
  double low = 0.0;  ///< 95 % interval; the value itself without resamples
  double high = 0.0;
};

struct PredicateResult {
  bool holds = false;
  double support = 0.0;          ///< share of the resamples in which it holds; without them 0 or 1
  std::vector<TermValue> terms;  ///< every call, in the order of the text
};

/// Evaluates `text`. A comparison with NaN is false. `resamples` above 0: also on that many draws
/// of the seeds with replacement (basic bootstrap, reflected at the sample's statistic; the same
/// draw for all runs, deterministic). Bounds of a maximum can then only be larger than the
/// sample's. Throws Error naming the text and its error.
PredicateResult evaluate_predicate(const std::string& text, const MeasureSource& source,
                                   int resamples = 0);

/// min, max, mean, median, std (of the sample) of values; NaN if there are none. Throws Error for
/// another name.
double statistic_of(const std::string& statistic, std::vector<double> values);

}  // namespace photocoag
