// `photocoag campaign`: thousands of virtual spots, on all cores and ranks.
#include "campaign_command.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "command.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "options.hpp"
#include "photocoag/campaign/report.hpp"
#include "photocoag/campaign/results_file.hpp"
#include "photocoag/campaign/run_campaign.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/report/report.hpp"
#include "photocoag/run/run_folder.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

nlohmann::ordered_json replay_object(const Campaign& campaign, const SpotRecord& record) {
  nlohmann::ordered_json object = {{"spot", record.spot}, {"seed", record.noise_seed}};
  for (std::size_t i = 0; i < campaign.inputs.size(); ++i) {
    object["inputs"][campaign.inputs[i].key] = record.inputs[i];
  }
  for (std::size_t i = 0; i < outcome_columns().size(); ++i) {
    // NaN becomes null.
    object["outcomes"][std::string(outcome_columns()[i].name)] = record.outcomes[i];
  }
  return object;
}

int replay(const CampaignCommandOptions& options, const Campaign& campaign) {
  if (*options.replay >= campaign.spots) {
    throw Error(ErrorParts{.where = "--replay",
                           .found = std::to_string(*options.replay),
                           .accepted = fmt::format("0 to {}", campaign.spots - 1)});
  }
  if (!options.out.empty()) check_run_folder(options.out);
  const SpotModels models = make_spot_models(campaign, !options.no_cache);
  SpotRunner runner(campaign, models);
  const SpotRecord record = runner.run(*options.replay);
  const ClaimedFolder claimed = options.out.empty() ? open_new_run_folder(runner.config())
                                                    : open_run_folder(options.out, runner.config());
  const fs::path& folder = claimed.path();
  write_run(folder, runner.config(), runner.treatment());
  write_report(folder);
  if (options.json) return with_json(true, "campaign", 0, folder, replay_object(campaign, record));
  for (std::size_t i = 0; i < campaign.inputs.size(); ++i) {
    print("{} = {}\n", campaign.inputs[i].key, record.inputs[i]);
  }
  for (std::size_t i = 0; i < outcome_columns().size(); ++i) {
    print("{} = {}\n", outcome_columns()[i].name, record.outcomes[i]);
  }
  say("report    {}\n", (folder / "report.html").string());
  return 0;
}

// Draws progress, rate and remaining time.
void show(const CampaignProgress& now) {
  const auto left = static_cast<long long>(now.seconds_left);
  draw_progress(
      "campaign", static_cast<double>(now.done) / static_cast<double>(now.total),
      fmt::format("{} of {} spots, {:.0f}/s, {}:{:02}:{:02} left; Ctrl-C: continue later", now.done,
                  now.total, now.per_second, left / 3600, left / 60 % 60, left % 60));
}

std::string held_text(double mean_K, double deviation_K, std::string_view of) {
  return std::isfinite(mean_K) ? fmt::format("{:+.3f} +- {:.3f} K {}", mean_K, deviation_K, of)
                               : fmt::format("no temperature {}", of);
}

// Peak resident memory of this process.
double most_memory_MB() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kB = 0.0;
    if (word == "VmHWM:" && status >> kB) return kB * 1.024e-3;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

void say_spots(const Campaign& campaign, const CampaignResult& result, const Ranks& ranks) {
  const auto computed = static_cast<double>(result.computed);
  say("spots     {} of {}, {} computed now in {:.1f} s ({:.0f} per second), {} rank{}\n",
      result.journal->spots().size(), campaign.spots, result.computed, result.seconds,
      result.seconds > 0.0 ? computed / result.seconds : 0.0, ranks.size(),
      ranks.size() == 1 ? "" : "s");
  if (ranks.size() == 1 && result.cpu_seconds > 0.0) {
    say("          {:.0f} per second of processor time\n", computed / result.cpu_seconds);
  }
}

void say_stopped() { say("STOPPED   the same command continues where this one stopped\n"); }

int run_ranks(const CampaignCommandOptions& options, Ranks& ranks) {
  const Campaign campaign = load_campaign(options.file);
  if (options.replay) return ranks.rank() == 0 ? replay(options, campaign) : 0;
  if (options.estimate) return ranks.rank() == 0 ? estimate_campaign(options, campaign) : 0;
  if (options.out.empty()) {
    throw Error(ErrorParts{.where = "--out",
                           .problem = "missing: an interrupted campaign continues in its folder",
                           .accepted = "a new or empty folder, or that of this campaign"});
  }
  stop_on_signals();
  const CampaignOptions request{
      .out = options.out, .threads = options.threads, .use_cache = !options.no_cache};
  const CampaignResult result = run_campaign(campaign, request, ranks, stop_requested(), show);
  if (ranks.rank() != 0) return 0;
  clear_progress();
  say("photocoag {}: {}\n", version(), kResearchNotice);
  say_spots(campaign, result, ranks);
  if (!result.complete && options.only_complete) {
    say_stopped();
    return with_json(options.json, "campaign", 1, request.out,
                     {{"spots", result.journal->spots().size()}, {"spots_wanted", campaign.spots}});
  }
  const fs::path table = request.out / "campaign.h5";
  write_results(table, campaign, *result.journal);
  const SpotRows rows = open_results(table, campaign);
  const CampaignStatistics statistics = campaign_statistics(rows, request.out);
  const CampaignSummary& summary = statistics.summary;
  const std::string json = campaign_json(campaign, summary);
  write_file((request.out / "summary.json").string(), json);
  if (rows.count > 0) {
    const std::string again = fmt::format("./photocoag campaign {} --replay", options.file);
    write_file((request.out / "index.html").string(),
               campaign_page(campaign, statistics, result.full_order_states, again));
    write_file((request.out / "tables.md").string(),
               campaign_markdown(campaign, statistics, result.full_order_states));
  }
  say("limit     exceeded in {} spots: {:.4g} %, 95 % interval {:.4g} to {:.4g} %\n",
      summary.violations, 100.0 * summary.probability, 100.0 * summary.probability_low,
      100.0 * summary.probability_high);
  say("held      {}; {} spots never at 95 %\n",
      held_text(summary.held_mean_K, summary.held_deviation_K, "from the reference after 50 ms"),
      summary.never_reached);
  say("          {}\n",
      held_text(summary.half_mean_K, summary.half_deviation_K, "over the second half"));
  if (campaign.config.safety.supervised) {
    say("stopped   {} spots by the supervisor\n", summary.stopped);
  }
  say("memory    {:.0f} MB at most\n", most_memory_MB());
  say("results   {}\nsummary   {}\nreport    {}\n", table.string(),
      (request.out / "summary.json").string(), (request.out / "index.html").string());
  if (!result.complete) say_stopped();
  return with_json(options.json, "campaign", result.complete ? 0 : 1, request.out,
                   summary_object(json));
}

int campaign_command(const CampaignCommandOptions& options) {
  Ranks ranks;
  try {
    return run_ranks(options, ranks);
  } catch (const std::exception& error) {
    if (ranks.size() == 1) throw;
    say("photocoag: rank {}: {}\n", ranks.rank(), error.what());
    std::fflush(stderr);
    ranks.abort(kExitBadInput);  // the others wait for this one
  }
}

const Command kCampaign(
    "campaign", "thousands of virtual spots with random tissue, on all cores and machines",
    campaign_command, [](CommandLine& command, CampaignCommandOptions& options) {
      command.add_option("FILE", options.file, "campaign file (TOML)").required();
      command
          .add_option("--out", options.out,
                      "folder, new, empty, or that of the same campaign, which is continued")
          .type_name("DIR");
      command.add_option("--threads", options.threads, "per rank; default: all cores it may use")
          .check(whole_number_from(1, 1024))
          .type_name("N");
      command
          .add_option("--replay", options.replay,
                      "only this spot, bit-identical, with a run folder and a report")
          .check(whole_number_from(0, std::numeric_limits<std::int64_t>::max()))
          .type_name("SPOT");
      command
          .add_option(
              "--estimate", options.estimate,
              "instead: consistency of the estimated peak with its stated deviation over the first "
              "N spots, cycle by cycle, and comparison with a batch estimate of all samples")
          .check(whole_number_from(1, std::numeric_limits<std::int64_t>::max()))
          .excludes("--replay")
          .type_name("N");
      command
          .add_flag("--only-complete", options.only_complete,
                    "if interrupted, keep the spots but write no table and no report yet")
          .excludes("--replay")
          .excludes("--estimate");
      add_json(command, options.json).excludes("--estimate");
      command.add_flag("--no-cache", options.no_cache,
                       "make the reduced model again, without the cache");
      command.footer(fmt::format(
          "Examples:\n"
          "  photocoag campaign studies/campaigns/demo.toml --out runs/demo\n"
          "  mpirun -n 2 photocoag campaign studies/campaigns/demo.toml --out runs/demo\n"
          "  photocoag campaign studies/campaigns/demo.toml --replay 17\n"
          "  photocoag campaign studies/campaigns/uncertain-1khz.toml --estimate 1000\n"
          "Several machines: {}.\nExit code: 0 complete; 1 interrupted, to be continued; 2 bad "
          "input.\n{}",
          Ranks::has_mpi() ? "through MPI, one folder on the first rank's machine"
                           : "this build has no MPI",
          kResearchNotice));
    });

}  // namespace

}  // namespace photocoag
