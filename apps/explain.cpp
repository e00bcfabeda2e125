// `photocoag explain`: searches for conditions that reproduce the paper's experiments.

#include <chrono>
#include <filesystem>
#include <string>

#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/study/explain.hpp"
#include "progress.hpp"
#include "study_folders.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

struct ExplainOptions {
  std::string file;  ///< empty: the shipped one
  std::string out;   ///< folder, new or empty; empty: a new one below runs/
  bool quick = false;
  bool no_cache = false;
};

int explain_command(const ExplainOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  say("photocoag {}: {}\n", version(), kResearchNotice);
  const fs::path file =
      options.file.empty() ? shipped_studies() / "experiments/250hz.toml" : fs::path(options.file);
  const Explanation study = load_explanation(file);
  const ClaimedFolder folder = output_folder(options.out, "explanation");
  const ExplainOutcome outcome =
      explain(study, options.quick, !options.no_cache, progress_bar("explaining"));
  clear_progress();
  const ConfirmedSet& best = outcome.confirmed.front();
  print("best set: {}\nholds, of {} repetitions: as seen, in truth\n", best.label,
        best.repetitions().count());
  for (std::size_t i = 0; i < outcome.study.statements.size(); ++i) {
    print("  {:>4.0f} % {:>4.0f} %  {}\n", 100.0 * best.repetitions().share(i),
          100.0 * best.repetitions().true_share(i), outcome.study.statements[i].text);
  }
  write_explanation(folder.path(), outcome);
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  say("sets      {} combinations; {:.1f} s\n", outcome.together.size(), wall.count());
  say("report    {}\n", (folder.path() / "index.html").string());
  return 0;
}

const Command kExplain(
    "explain", "search for the bench, eye and tuning that reproduce the paper's experiments",
    explain_command, [](CommandLine& command, ExplainOptions& options) {
      command.add_option("FILE", options.file, "the search; default: the shipped one")
          .type_name("FILE");
      add_new_folder(command, options.out);
      command.add_flag("--quick", options.quick, "few repetitions, no sensitivity");
      command.add_flag("--no-cache", options.no_cache,
                       "make the reduced models again, without the cache");
      command.footer(
          footer("  photocoag explain --out runs/explanation\n"
                 "  photocoag explain studies/experiments/250hz.toml --quick"));
    });

}  // namespace

}  // namespace photocoag
