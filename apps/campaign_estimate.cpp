// `photocoag campaign FILE --estimate N`: consistency and accuracy of the estimated peak.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "campaign_command.hpp"
#include "console.hpp"
#include "doubling_cycles.hpp"
#include "photocoag/campaign/posterior_consistency.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/run/claimed_folder.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

constexpr double kConsistentFrom = 0.005;  // s: earlier there is hardly any information
constexpr std::size_t kFewestEyes = 3;     // a third of alpha each

using ByGroup = std::array<double, 4>;

void print_row(const std::string& label, const ByGroup& nees, const ByGroup& covered) {
  print("{:>16}", label);
  for (const double value : nees) print("{:>8.3f}", value);
  for (const double value : covered) print("{:>8.1f}", 100.0 * value);
  print("\n");
}

// Over the cycles from 5 ms on, each group by itself.
template <typename Pick>
void print_extreme(const PosteriorConsistency& all, const std::string& label, const Pick& pick) {
  constexpr double kRounding = 1e-9;
  const auto first =
      static_cast<std::size_t>(std::max(1.0, std::ceil(kConsistentFrom / all.period - kRounding))) -
      1;
  if (first >= all.cycles.size()) return;
  ByGroup nees = all.cycles[first].nees;
  ByGroup covered = all.cycles[first].covered;
  for (std::size_t k = first; k < all.cycles.size(); ++k) {
    for (std::size_t g = 0; g < nees.size(); ++g) {
      nees[g] = pick(nees[g], all.cycles[k].nees[g]);
      covered[g] = pick(covered[g], all.cycles[k].covered[g]);
    }
  }
  print_row(label, nees, covered);
}

void print_consistency(const PosteriorConsistency& all) {
  print("{:>16}{:>32}{:>32}\n", "", "error^2 / stated variance", "within 1.96 deviations, %");
  print("{:>16}", "time, ms");
  for (int side = 0; side < 2; ++side)
    print("{:>8}{:>8}{:>8}{:>8}", "all", "low", "middle", "high");
  print("   (thirds of alpha)\n");
  for (const std::size_t k : doubling_cycles(all.cycles.size())) {
    print_row(fmt::format("{:g}", static_cast<double>(k) * all.period * 1e3),
              all.cycles[k - 1].nees, all.cycles[k - 1].covered);
  }
  print_extreme(all, "from 5 on: least", [](double a, double b) { return std::min(a, b); });
  print_extreme(all, "most", [](double a, double b) { return std::max(a, b); });
  print(
      "\nrms error of the estimated peak, second half: {:.4f} K; of a batch estimate of the same "
      "samples, told\nthe eye's noise: {:.4f} K; ratio {:.4f}\n",
      all.rms_K, all.batch_rms_K, all.rms_K / all.batch_rms_K);
  print("\nheld if the whole record were known before, aimed once:\n");
  print("{:>24}{:>20}{:>24}\n", "limit probability, %", "over the limit", "held, K");
  for (const OfflineBound& bound : all.bounds) {
    print("{:>24g}{:>12} of {:<5}{:>+14.3f} +- {:.3f}\n", 100.0 * bound.probability,
          bound.over_limit, all.eyes, bound.held_K, bound.held_deviation_K);
  }
}

}  // namespace

int estimate_campaign(const CampaignCommandOptions& options, const Campaign& campaign) {
  const std::uint64_t eyes = *options.estimate;
  if (eyes < kFewestEyes || eyes > campaign.spots) {
    throw Error(ErrorParts{.where = "--estimate",
                           .found = std::to_string(eyes),
                           .accepted = fmt::format("{} to {}", kFewestEyes, campaign.spots)});
  }
  std::optional<ClaimedFolder> claimed;  // before the work
  if (!options.out.empty()) claimed.emplace(options.out);
  const SpotModels models = make_spot_models(campaign, !options.no_cache);
  const PosteriorConsistency all = posterior_consistency(
      campaign, models, eyes, [](double fraction) { draw_progress("estimating", fraction); });
  clear_progress();
  print("photocoag {}: {}\n", version(), kResearchNotice);
  print("{} eyes of {}\n\n", eyes, options.file);
  print_consistency(all);
  if (options.out.empty()) return 0;
  const fs::path folder = options.out;
  write_file((folder / "estimate.csv").string(), consistency_csv(all));
  write_file((folder / "offline-bound.json").string(), offline_bound_json(all, campaign));
  say("written   {0}/estimate.csv, {0}/offline-bound.json\n", options.out);
  return 0;
}

}  // namespace photocoag
