// `photocoag compare`: run folders, or campaigns, in one report.

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/campaign/pareto.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/study/sweep.hpp"
#include "study_folders.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

struct CompareRunsOptions {
  std::vector<std::string> runs;
  std::string out;
};

int compare_runs_command(const CompareRunsOptions& options) {
  const ClaimedFolder claimed = output_folder(options.out, "comparison");
  const fs::path& folder = claimed.path();
  const std::vector<fs::path> compared(options.runs.begin(), options.runs.end());
  if (std::any_of(compared.begin(), compared.end(), is_campaign_folder)) {
    compare_campaigns(compared, folder);
    print("{}", read_file((folder / "tables.md").string(), 1'000'000));
  } else {
    compare_runs(compared, folder);
  }
  say("report    {}\n", (folder / "index.html").string());
  return 0;
}

const Command kCompare(
    "compare",
    "several run folders in one report: one time axis, configuration differences; or several "
    "campaigns: violation against held temperature",
    compare_runs_command, [](CommandLine& command, CompareRunsOptions& options) {
      command
          .add_option("RUN", options.runs,
                      "run folders of treat or simulate, or folders of campaigns")
          .required();
      add_new_folder(command, options.out);
      command.footer(
          footer("  photocoag compare runs/first runs/second --out runs/both\n"
                 "  photocoag compare runs/pareto-nominal runs/pareto-chance-1-percent"));
    });

}  // namespace

}  // namespace photocoag
