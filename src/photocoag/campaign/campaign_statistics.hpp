// Role: offline; statistics of a campaign's rows for its page, tables and summary. Used by
// campaign/report and `photocoag campaign`. Memory does not depend on the number of rows. Units: in
// the names. Real-time promise: none.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "photocoag/campaign/campaign_file.hpp"
#include "photocoag/campaign/pair_sorter.hpp"
#include "photocoag/campaign/spot_rows.hpp"

namespace photocoag {

/// The numbers that head the report, also printed by the program.
struct CampaignSummary {
  std::uint64_t spots = 0;
  std::uint64_t violations = 0;  ///< spots whose true peak exceeded the limit
  double probability = 0.0;
  double probability_low = 0.0;  ///< 95 %, exact
  double probability_high = 0.0;
  double held_mean_K = 0.0;  ///< over the spots: true peak minus reference after 50 ms
  double held_deviation_K = 0.0;
  double half_mean_K = 0.0;  ///< the same over the second half
  double half_deviation_K = 0.0;
  double peak_max_K = 0.0;          ///< of all spots
  std::uint64_t stopped = 0;        ///< spots that the supervisor ended early
  std::uint64_t never_reached = 0;  ///< spots that never got to 95 % of the reference
};
CampaignSummary summarize_campaign(const SpotRows& rows);

struct OutcomeStatistics {
  static constexpr std::array kFractions = {0.01, 0.5, 0.99, 0.999, 1.0};
  double mean = 0.0;
  double deviation = 0.0;
  std::vector<double> quantiles;  ///< of kFractions
};

/// The tail: the spots with the highest peaks.
struct InputStatistics {
  double mean = 0.0;
  double deviation = 0.0;
  double rank_correlation = 0.0;  ///< with the highest peak
  double tail_mean = 0.0;
};

/// Percent of the spots per bin, from the 0.1 % to the 99.9 % quantile; outliers are in the outer
/// bins.
struct Histogram {
  double low = 0.0;
  double high = 0.0;
  std::vector<double> percent;
};

/// Outcomes that have a histogram, in its order.
struct HistogramOf {
  std::string_view outcome;
  bool log10 = false;
};
inline constexpr std::array kHistograms = {HistogramOf{"overshoot_K"},
                                           HistogramOf{"time_to_95_ms"},
                                           HistogramOf{"held_mean_error_K"},
                                           HistogramOf{"held_std_K"},
                                           HistogramOf{"absorption_error_percent"},
                                           HistogramOf{"dose_schlott_2012", true},
                                           HistogramOf{"dose_welch_polhamus", true}};

struct CampaignStatistics {
  static constexpr std::size_t kWorst = 10;
  static constexpr double kTail = 0.01;  ///< the share of spots in the tail

  CampaignSummary summary;
  std::vector<OutcomeStatistics> outcomes;  ///< in the order of outcome_columns()
  std::vector<InputStatistics> inputs;      ///< in the order of the campaign's
  std::vector<Histogram> histograms;        ///< in the order of kHistograms
  std::vector<SpotRecord> worst;            ///< the highest peaks, highest first
};

/// `folder`: for temporary files, none below `in_memory` rows. Throws Error.
CampaignStatistics campaign_statistics(const SpotRows& rows, const std::filesystem::path& folder,
                                       std::size_t in_memory = PairSorter::kInMemory);

/// Bytes of temporary files that campaign_statistics needs at most.
double statistics_bytes(double rows) noexcept;

}  // namespace photocoag
