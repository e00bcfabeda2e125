#include "study_commands.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <memory>

#include "configured.hpp"
#include "console.hpp"
#include "full_program.hpp"
#include "options.hpp"
#include "photocoag/campaign/pareto.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/page/page.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/study/explain.hpp"
#include "photocoag/study/reproduce.hpp"
#include "photocoag/study/sweep.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

// The shipped studies: beside an installed program, else in the source tree around its build tree.
fs::path shipped_studies() {
  const fs::path plan =
      find_from_program({"share/photocoag/studies/plan.toml", "studies/plan.toml"}, 8);
  return plan.empty() ? fs::path("studies") : plan.parent_path();
}

// The folder asked for, or a new one below runs/.
ClaimedFolder output_folder(const std::string& out, const std::string& name) {
  if (!out.empty()) return ClaimedFolder(out);
  return ClaimedFolder::next_after(
      fs::path("runs") / fmt::format("{}-{:%Y%m%d-%H%M%S}", name, fmt::gmtime(std::time(nullptr))));
}

}  // namespace

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
  const std::vector<StudyOutcome> outcomes = reproduce(
      request,
      [](std::string_view label, double fraction) { draw_progress("studies", fraction, label); });
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

int explain_command(const ExplainOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  say("photocoag {}: {}\n", version(), kResearchNotice);
  const fs::path file =
      options.file.empty() ? shipped_studies() / "experiments/250hz.toml" : fs::path(options.file);
  const Explanation study = load_explanation(file);
  const ClaimedFolder folder = output_folder(options.out, "explanation");
  const ExplainOutcome outcome =
      explain(study, options.quick, !options.no_cache, [](std::string_view label, double fraction) {
        draw_progress("explaining", fraction, label);
      });
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

int sweep_command(const SweepOptions& options) {
  say("photocoag {}: {}\n", version(), kResearchNotice);
  std::vector<Varied> varied;
  for (const std::string& option : options.vary) varied.push_back(parse_varied(option));
  configured(Use::kSimulate, options.config, options.set);  // says what has no effect
  const ClaimedFolder claimed = output_folder(options.out, "sweep");
  const fs::path& folder = claimed.path();
  const std::vector<SweepPoint> points =
      sweep(options.config, options.set, varied, options.seeds, !options.no_cache,
            [](std::size_t done, std::size_t total) {
              draw_progress("sweeping", static_cast<double>(done) / static_cast<double>(total),
                            fmt::format("{} of {} runs", done, total));
            });
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

namespace {

void add_explain(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ExplainOptions>();
  CLI::App* command = app.add_subcommand(
      "explain", "which bench, eye and tuning make the paper's experiments come out as it says");
  command->add_option("FILE", options->file, "the search; default: the shipped one")
      ->type_name("FILE");
  command->add_option("--out", options->out, "folder, new or empty; default: a new one below runs/")
      ->type_name("DIR");
  command->add_flag("--quick", options->quick, "few repetitions, no sensitivity");
  command->add_flag("--no-cache", options->no_cache, "make the reduced models anew");
  command->footer(
      fmt::format("Examples:\n  photocoag explain --out runs/explanation\n"
                  "  photocoag explain studies/experiments/250hz.toml --quick\n{}",
                  kResearchNotice));
  command->callback([&exit_code, options] { exit_code = explain_command(*options); });
}

void add_sweep(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SweepOptions>();
  CLI::App* command = app.add_subcommand(
      "sweep", "simulate every combination of some values: table, CSV, overlay plot");
  add_common(*command, *options);
  command
      ->add_option("--vary", options->vary,
                   "a key and its values; may be repeated: every combination is run")
      ->required()
      ->type_name("KEY=V1,V2,...")
      ->allow_extra_args(false);
  command->add_option("--seeds", options->seeds, "noise seeds per combination, from run.seed on")
      ->check(whole_number_from(1, 1000))
      ->type_name("N");
  command->add_option("--out", options->out, "folder, new or empty; default: a new one below runs/")
      ->type_name("DIR");
  command->add_flag("--no-cache", options->no_cache, "make the reduced models anew");
  command->footer(fmt::format(
      "Examples:\n"
      "  photocoag sweep --config configs/paper-250hz-a.toml --vary control.horizon=2,5,10 \\\n"
      "    --vary control.power_weight=0,5e1,5e4 --seeds 5\n"
      "Over the seeds: the largest peak, error and power, the median time.\n{}",
      kResearchNotice));
  command->callback([&exit_code, options] { exit_code = sweep_command(*options); });
}

void add_compare(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CompareRunsOptions>();
  CLI::App* command = app.add_subcommand(
      "compare",
      "several run folders in one report: one time axis, configuration differences; or several "
      "campaigns: violation against held temperature");
  command
      ->add_option("RUN", options->runs,
                   "run folders of treat or simulate, or folders of campaigns")
      ->required();
  command->add_option("--out", options->out, "folder, new or empty; default: a new one below runs/")
      ->type_name("DIR");
  command->footer(
      fmt::format("Examples:\n  photocoag compare runs/first runs/second --out runs/both\n"
                  "  photocoag compare runs/pareto-nominal runs/pareto-chance-1-percent\n{}",
                  kResearchNotice));
  command->callback([&exit_code, options] { exit_code = compare_runs_command(*options); });
}

}  // namespace

void add_study_commands(CLI::App& app, int& exit_code) {
  const auto reproduce_options = std::make_shared<ReproduceCommandOptions>();
  CLI::App* reproduce_app = app.add_subcommand(
      "reproduce",
      "every table and figure of the paper's results, with a verdict for each of its claims");
  reproduce_app
      ->add_option("--out", reproduce_options->out,
                   "folder, new or empty; default: a new one below runs/")
      ->type_name("DIR");
  reproduce_app
      ->add_option("--studies", reproduce_options->studies,
                   "folder with plan.toml and the studies; default: the shipped ones")
      ->type_name("DIR");
  reproduce_app
      ->add_option("--seeds", reproduce_options->seeds,
                   "noise seeds per curve; default: as plan.toml says")
      ->check(whole_number_from(1, 1000))
      ->type_name("N");
  reproduce_app->add_flag("--quick", reproduce_options->quick,
                          "without the sensitivities: for continuous integration");
  reproduce_app->add_flag("--no-cache", reproduce_options->no_cache,
                          "make the reduced models anew");
  reproduce_app->footer(fmt::format(
      "Examples:\n  photocoag reproduce --out runs/paper\n  photocoag reproduce --quick\n"
      "Exit code: 0 good; 1 a verdict is not the one that the study's file expects; 2 bad "
      "input.\n{}",
      kResearchNotice));
  reproduce_app->callback(
      [&exit_code, reproduce_options] { exit_code = reproduce_command(*reproduce_options); });
  add_explain(app, exit_code);
  add_sweep(app, exit_code);
  add_compare(app, exit_code);
}

}  // namespace photocoag
