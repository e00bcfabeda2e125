// Role: the program; commands for many runs at once: reproduce, sweep, compare, campaign. Each
// returns the exit code.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"

namespace CLI {
class App;
}

namespace photocoag {

struct Campaign;

struct ReproduceCommandOptions {
  std::string out;      ///< folder, new or empty; empty: a new one below runs/
  std::string studies;  ///< folder; empty: the shipped one
  bool quick = false;
  int seeds = 0;  ///< 0: as the plan says
  bool no_cache = false;
};

struct ExplainOptions {
  std::string file;  ///< empty: the shipped one
  std::string out;   ///< folder, new or empty; empty: a new one below runs/
  bool quick = false;
  bool no_cache = false;
};

struct SweepOptions : CommonOptions {
  std::vector<std::string> vary;  ///< "key=v1,v2,…"
  int seeds = 1;
  std::string out;  ///< folder, new or empty; empty: a new one below runs/
};

struct CompareRunsOptions {
  std::vector<std::string> runs;
  std::string out;
};

struct CampaignCommandOptions {
  std::string file;
  std::string out;
  unsigned threads = 0;                   ///< per rank; 0: all cores that the rank may use
  std::optional<std::uint64_t> replay;    ///< only this spot, with a run folder
  std::optional<std::uint64_t> estimate;  ///< instead: how honest the estimate of so many spots is
  bool only_complete = false;             ///< no table and no report of an interrupted campaign
  bool json = false;                      ///< the outcome as JSON on standard output
  bool no_cache = false;
};

int reproduce_command(const ReproduceCommandOptions& options);
int sweep_command(const SweepOptions& options);
int compare_runs_command(const CompareRunsOptions& options);
int campaign_command(const CampaignCommandOptions& options);
/// Of `campaign --estimate`.
int estimate_campaign(const CampaignCommandOptions& options, const Campaign& campaign);

/// Adds `campaign`; it stores its exit code.
void add_campaign(CLI::App& app, int& exit_code);
/// Adds the others of this file.
void add_study_commands(CLI::App& app, int& exit_code);

}  // namespace photocoag
