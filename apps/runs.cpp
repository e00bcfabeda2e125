// `photocoag runs`: the results of all run folders below a folder, one line each.
#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command.hpp"
#include "console.hpp"
#include "json_object.hpp"
#include "options.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/report/run_log.hpp"
#include "photocoag/report/verdict.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct RunsOptions {
  std::string folder = "runs";
  bool json = false;
};

// Run folders below `root`, itself included, by name, i.e. oldest first.
std::vector<fs::path> run_folders(const fs::path& root) {
  std::vector<fs::path> found;
  const auto add = [&found](const fs::path& folder) {
    // Campaigns and sessions have a summary, too, and a page of their own.
    const bool many = fs::exists(folder / "campaign.toml") || fs::exists(folder / "session.json");
    if (!many && fs::exists(folder / "summary.json")) found.push_back(folder);
  };
  add(root);
  for (const fs::directory_entry& entry : fs::directory_iterator(root)) {
    if (entry.is_directory()) add(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

Json run_object(const fs::path& folder) {
  Json run = {{"folder", folder.string()}};
  try {
    const auto [config, log, summary] = read_run_files(folder);
    const Verdict verdict = judge(log, summary, config);
    run["verdict"] = verdict.name;
    run["said"] = verdict.text;
    run["seed"] = summary.seed;
    run["config_sha256"] = summary.config_sha256;
  } catch (const Error& error) {
    run["verdict"] = "Unreadable";
    run["said"] = std::string("Unreadable: ") + error.what();
  }
  return run;
}

int runs_command(const RunsOptions& options) {
  if (!fs::is_directory(options.folder)) {
    throw Error(ErrorParts{.where = "DIR",
                           .problem = "not a folder",
                           .found = options.folder,
                           .accepted = "a folder with run folders in it"});
  }
  Json runs = Json::array();
  std::size_t longest = 0;
  for (const fs::path& folder : run_folders(options.folder)) {
    runs.push_back(run_object(folder));
    longest = std::max(longest, folder.string().size());
  }
  if (options.json) return with_json(true, "runs", 0, options.folder, {{"runs", runs}});
  for (const Json& run : runs) {
    print("{:<{}}  {}\n", run["folder"].get<std::string>(), longest,
          run["said"].get<std::string>());
  }
  return 0;
}

const Command kRuns("runs", "outcomes of all run folders below a folder", runs_command,
                    [](CommandLine& command, RunsOptions& options) {
                      command.add_option("DIR", options.folder, "holds run folders, or is one")
                          .type_name("DIR")
                          .show_default();
                      add_json(command, options.json);
                      command.footer(
                          footer("  photocoag runs\n"
                                 "  photocoag runs runs/sweep --json"));
                    });

}  // namespace
}  // namespace photocoag
