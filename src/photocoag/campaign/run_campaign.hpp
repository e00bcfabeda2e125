// Role: offline; runs the spots of a campaign on all threads of all ranks. Used by `photocoag
// campaign`. A spot's record depends on the campaign and its number alone, so ranks, threads and
// interruptions do not change results. Memory does not depend on the number of spots. Real-time
// promise: none.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>

#include "photocoag/campaign/journal.hpp"
#include "photocoag/campaign/ranks.hpp"
#include "photocoag/campaign/spot.hpp"

namespace photocoag {

struct CampaignProgress {
  std::uint64_t done = 0;  ///< of all spots, those found in the journal included
  std::uint64_t total = 0;
  double per_second = 0.0;  ///< of this session
  double seconds_left = 0.0;
};

struct CampaignOptions {
  std::filesystem::path out;  ///< new, empty, or the folder of this campaign, to be continued
  unsigned threads = 0;       ///< per rank; 0: as many as the rank may use
  bool use_cache = true;
};

struct CampaignResult {
  std::unique_ptr<Journal> journal;  ///< with all spots that are done, still locked; on rank 0
  bool complete = false;
  double seconds = 0.0;        ///< of this session
  double cpu_seconds = 0.0;    ///< CPU time, on this rank, in this session
  std::uint64_t computed = 0;  ///< in this session
  std::size_t full_order_states = 0;
};

/// Bytes that journal, table and temporary files of a campaign take.
double campaign_bytes(const Campaign& campaign) noexcept;

/// Called by all ranks. Throws Error before writing anything if the disk is too full for all of it.
/// `stop` ends it early: spots in flight are finished and kept. `progress` is called on rank 0, a
/// few times per second. Throws Error.
CampaignResult run_campaign(const Campaign& campaign, const CampaignOptions& options, Ranks& ranks,
                            const std::atomic<bool>& stop,
                            const std::function<void(const CampaignProgress&)>& progress = {});

}  // namespace photocoag
