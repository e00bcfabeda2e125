// `photocoag reproduce`: every table and figure of the paper's results.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/study/reproduce.hpp"
#include "progress.hpp"
#include "study_folders.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

struct ReproduceCommandOptions {
  std::string out;      ///< folder, new or empty; empty: a new one below runs/
  std::string studies;  ///< folder; empty: the shipped one
  bool quick = false;
  int seeds = 0;  ///< 0: as the plan says
  bool no_cache = false;
};

int reproduce_command(const ReproduceCommandOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  say("photocoag {}: {}\n", version(), kResearchNotice);
  const ClaimedFolder folder = output_folder(options.out, "reproduction");
  const ReproduceOptions request{
      .studies = options.studies.empty() ? shipped_studies() : fs::path(options.studies),
      .out = folder.path(),
      .quick = options.quick,
      .seeds = options.seeds,
      .use_cache = !options.no_cache};
  const std::vector<StudyOutcome> outcomes = reproduce(request, progress_bar("studies"));
  clear_progress();
  std::size_t count[kClaimVerdicts] = {};
  bool as_expected = true;
  for (const StudyOutcome& outcome : outcomes) {
    print("{} ({} seeds)\n", outcome.study.title, outcome.seeds);
    for (const JudgedClaim& claim : outcome.claims) {
      ++count[static_cast<int>(claim.verdict)];
      print("  {:<21} {}{}\n", name_of(claim.verdict), claim.claim.text,
            claim.as_expected()
                ? ""
                : fmt::format("  (CHANGED: {} expects \"{}\")",
                              outcome.study.file.filename().string(), claim.claim.expected));
      as_expected = as_expected && claim.as_expected();
    }
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  say("claims    {} hold, {} differ, {} undecided, {} cannot be judged here; {:.1f} s\n", count[0],
      count[1], count[2], count[3], wall.count());
  say("report    {}\n", (request.out / "index.html").string());
  return as_expected ? 0 : 1;
}

const Command kReproduce(
    "reproduce",
    "every table and figure of the paper's results, with a verdict for each of its claims",
    reproduce_command, [](CommandLine& command, ReproduceCommandOptions& options) {
      add_new_folder(command, options.out);
      command
          .add_option("--studies", options.studies,
                      "folder with plan.toml and the studies; default: the shipped ones")
          .type_name("DIR");
      command
          .add_option("--seeds", options.seeds, "noise seeds per curve; default: as plan.toml says")
          .check(whole_number_from(1, 1000))
          .type_name("N");
      command.add_flag("--quick", options.quick, "without the sensitivities: half of the time");
      command.add_flag("--no-cache", options.no_cache,
                       "make the reduced models again, without the cache");
      command.footer(fmt::format(
          "Examples:\n  photocoag reproduce --out runs/paper\n  photocoag reproduce --quick\n"
          "Exit code: 0 good; 1 a verdict is not the one that the study's file expects; 2 bad "
          "input.\n{}",
          kResearchNotice));
    });

}  // namespace

}  // namespace photocoag
