// Role: offline; the page of a campaign. Used by `photocoag campaign`. One self-contained file; the
// same spots give the same bytes. Units: beside every number. Real-time promise: none.
#pragma once

#include <string>
#include <vector>

#include "photocoag/campaign/spot.hpp"
#include "photocoag/page/page.hpp"

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
CampaignSummary summarize_campaign(const std::vector<SpotRecord>& spots);

/// summary.json: the summary with its seed. Null: no spot has a value.
std::string campaign_json(const Campaign& campaign, const std::vector<SpotRecord>& spots);

/// A table as Markdown.
std::string as_markdown(const Table& table);

/// `replay`: the command up to the number of the spot.
std::string campaign_page(const Campaign& campaign, const std::vector<SpotRecord>& spots,
                          std::size_t full_order_states, const std::string& replay);

/// The same figures as Markdown: one line of summary, then the tables of outcomes and inputs.
std::string campaign_markdown(const Campaign& campaign, const std::vector<SpotRecord>& spots,
                              std::size_t full_order_states);

}  // namespace photocoag
