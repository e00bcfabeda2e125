// Role: offline; finished campaigns beside each other: how often the limit is exceeded against how
// high the peak is held. Used by `photocoag compare`. Format: docs/studies.md. Units: beside every
// number. Real-time promise: none.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/page/page.hpp"

namespace photocoag {

/// One campaign, of its summary.json; or what a batch estimate of the whole record would hold.
struct ParetoPoint {
  std::string name;  ///< of the folder
  std::string campaign;
  std::uint64_t spots = 0;
  std::uint64_t violations = 0;
  double probability = 0.0;
  double probability_low = 0.0;  ///< 95 %, exact
  double probability_high = 0.0;
  double held_mean = 0.0;  ///< K; true peak minus reference_, after 50 ms; NaN: all stopped
  double held_deviation = 0.0;
  double half_mean = 0.0;  ///< K, over the second half
  double reached = 0.0;    ///< fraction of the spots
  std::uint64_t stopped = 0;
  double peak_max = 0.0;        ///< K
  double peak_reference = 0.0;  ///< K
  double limit = 0.0;           ///< K
  bool is_bound = false;        ///< known afterwards only: reached, half_mean, peak_max are NaN
};

/// Whether a folder is one of `photocoag campaign`, with or without `--estimate`.
bool is_campaign_folder(const std::filesystem::path& folder);

/// Throws Error naming the file and key.
ParetoPoint read_pareto_point(const std::filesystem::path& folder);

/// Those that no other one beats in both, by held temperature; bounds aside.
std::vector<std::size_t> pareto_front(const std::vector<ParetoPoint>& points);

/// Violation probability with its interval, logarithmic, over the held peak.
Figure pareto_figure(const std::vector<ParetoPoint>& points);
Table pareto_table(const std::vector<ParetoPoint>& points);

/// index.html, compare.svg, compare.csv, tables.md in `out`, new or empty. Throws Error.
void compare_campaigns(const std::vector<std::filesystem::path>& folders,
                       const std::filesystem::path& out);

}  // namespace photocoag
