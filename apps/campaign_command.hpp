// Role: the program; declarations shared by the two files of `campaign`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace photocoag {

struct Campaign;

struct CampaignCommandOptions {
  std::string file;
  std::string out;
  unsigned threads = 0;                 ///< per rank; 0: all cores that the rank may use
  std::optional<std::uint64_t> replay;  ///< only this spot, with a run folder
  std::optional<std::uint64_t>
      estimate;                ///< instead: consistency of the estimate over the first N spots
  bool only_complete = false;  ///< no table and report of an interrupted campaign
  bool json = false;           ///< the outcome as JSON on standard output
  bool no_cache = false;
};

/// Runs --estimate. Returns the exit code.
int estimate_campaign(const CampaignCommandOptions& options, const Campaign& campaign);

}  // namespace photocoag
