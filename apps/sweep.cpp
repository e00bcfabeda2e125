// `photocoag sweep`: simulates every combination of given values.
#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/page/page.hpp"
#include "photocoag/study/sweep.hpp"
#include "progress.hpp"
#include "study_folders.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

struct SweepOptions : CommonOptions {
  std::vector<std::string> vary;  ///< "key=v1,v2,…"
  int seeds = 1;
  std::string out;  ///< folder, new or empty; empty: a new one below runs/
};

int sweep_command(const SweepOptions& options) {
  say("photocoag {}: {}\n", version(), kResearchNotice);
  std::vector<Varied> varied;
  for (const std::string& option : options.vary) varied.push_back(parse_varied(option));
  configured(Use::kSimulate, options.config, options.set);  // reports keys without effect
  const ClaimedFolder claimed = output_folder(options.out, "sweep");
  const fs::path& folder = claimed.path();
  const std::vector<SweepPoint> points = sweep(options.config, options.set, varied, options.seeds,
                                               !options.no_cache, progress_bar("sweeping"));
  clear_progress();
  for (const Varied& one : varied) print("{:<{}}", one.key, one.key.size() + 2);
  for (const auto& [measure, statistic] : sweep_columns())
    print("{:>{}}", measure, measure.size() + 2);
  print("\n");
  for (const SweepPoint& point : points) {
    for (std::size_t i = 0; i < varied.size(); ++i) {
      print("{:<{}}", point.values[i], varied[i].key.size() + 2);
    }
    for (const auto& [measure, statistic] : sweep_columns()) {
      const double value = statistic_of(statistic, point.result.measures.at(measure));
      print("{:>{}}", number_text(value, ""), measure.size() + 2);
    }
    print("\n");
  }
  write_sweep(folder, varied, points, options.seeds);
  say("report    {}\n", (folder / "index.html").string());
  return 0;
}

const Command kSweep(
    "sweep", "simulate every combination of the given values: table, CSV, overlay plot",
    sweep_command, [](CommandLine& command, SweepOptions& options) {
      add_common(command, options);
      command
          .add_option("--vary", options.vary,
                      "a key and its values; may be repeated: every combination is run")
          .required()
          .type_name("KEY=V1,V2,...")
          .one_value_each();
      command.add_option("--seeds", options.seeds, "noise seeds per combination, from run.seed on")
          .check(whole_number_from(1, 1000))
          .type_name("N");
      add_new_folder(command, options.out);
      command.add_flag("--no-cache", options.no_cache,
                       "make the reduced models again, without the cache");
      command.footer(footer(
          "  photocoag sweep --config configs/paper-250hz-a.toml --vary control.horizon=2,5,10 \\\n"
          "    --vary control.power_weight=0,5e1,5e4 --seeds 5\n"
          "Over the seeds: the largest peak, error and power, the median time."));
    });

}  // namespace

}  // namespace photocoag
