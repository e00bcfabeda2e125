// Role: offline; compares finished campaigns: violation probability against held peak. Used by
// `photocoag compare`. Format: docs/studies.md. Units: beside every number. Real-time promise:
// none.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/page/page.hpp"

namespace photocoag {

/// One campaign, from its summary.json; or the offline bound of a batch estimate of the whole
/// record.
struct ParetoPoint {
  std::string name;  ///< of the folder
  std::string campaign;
  std::uint64_t spots = 0;
  std::uint64_t violations = 0;
  double probability = 0.0;
  double probability_low = 0.0;  ///< 95 %, exact
  double probability_high = 0.0;
  double held_mean = 0.0;  ///< K; true peak minus reference, after 50 ms; NaN: all stopped
  double held_deviation = 0.0;
  double half_mean = 0.0;  ///< K, over the second half
  double reached = 0.0;    ///< fraction of the spots
  std::uint64_t stopped = 0;
  double peak_max = 0.0;        ///< K
  double peak_reference = 0.0;  ///< K
  double limit = 0.0;           ///< K
  bool is_bound = false;        ///< an offline bound: reached, half_mean, peak_max are NaN
};

/// True for a folder of `photocoag campaign`, with or without `--estimate`.
bool is_campaign_folder(const std::filesystem::path& folder);

/// Throws Error naming the file and key.
ParetoPoint read_pareto_point(const std::filesystem::path& folder);

/// Indices of the Pareto-optimal points by held temperature, without bounds.
std::vector<std::size_t> pareto_front(const std::vector<ParetoPoint>& points);

/// Violation probability with its interval, logarithmic, over the held peak.
Figure pareto_figure(const std::vector<ParetoPoint>& points);
Table pareto_table(const std::vector<ParetoPoint>& points);

/// index.html, compare.svg, compare.csv, tables.md in `out`, new or empty. Throws Error.
void compare_campaigns(const std::vector<std::filesystem::path>& folders,
                       const std::filesystem::path& out);

}  // namespace photocoag
