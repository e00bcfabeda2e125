// Role: offline; statistics for reports. Used by campaign, session. Real-time promise: none.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace photocoag {

/// Exact (Clopper-Pearson) interval of a probability after `hits` of `trials`, at `confidence`.
std::pair<double, double> binomial_interval(std::uint64_t hits, std::uint64_t trials,
                                            double confidence = 0.95);

/// Spearman's rank correlation; ties get their mean rank. 0 if one of them is constant.
double rank_correlation(const std::vector<double>& x, const std::vector<double>& y);

/// Probability `fraction` quantile of the finite values (nearest rank); NaN if there are none.
double quantile(std::vector<double> values, double fraction);

/// Mean and standard deviation (of the sample) of the finite values.
std::pair<double, double> mean_and_deviation(const std::vector<double>& values);

}  // namespace photocoag
