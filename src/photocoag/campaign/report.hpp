// Role: offline; page, tables and summary of a campaign. Used by `photocoag campaign`. One
// self-contained file; the same spots give the same bytes. Units: beside every number. Real-time
// promise: none.
#pragma once

#include <string>

#include "photocoag/campaign/campaign_statistics.hpp"
#include "photocoag/page/page.hpp"

namespace photocoag {

/// summary.json: the summary with its seed. Null: no spot has a value.
std::string campaign_json(const Campaign& campaign, const CampaignSummary& summary);

/// A table as Markdown.
std::string as_markdown(const Table& table);

/// `replay`: the command up to the number of the spot.
std::string campaign_page(const Campaign& campaign, const CampaignStatistics& statistics,
                          std::size_t full_order_states, const std::string& replay);

/// The same figures as Markdown: one line of summary, then the tables of outcomes and inputs.
std::string campaign_markdown(const Campaign& campaign, const CampaignStatistics& statistics,
                              std::size_t full_order_states);

}  // namespace photocoag
