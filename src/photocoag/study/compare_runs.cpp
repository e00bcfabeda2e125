// Several run folders in one report.
#include <fmt/format.h>

#include <map>
#include <optional>
#include <set>

#include "photocoag/config/source.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/page/page.hpp"
#include "photocoag/report/run_log.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/study/overlay.hpp"
#include "photocoag/study/sweep.hpp"

namespace photocoag {
namespace {

struct Loaded : RunFiles {
  std::string name;
  std::map<std::string, std::string> keys;  // full key -> text
};

// The word that names an element of an array of tables: a layer's name, a quantity's key.
std::string name_of(const Value& element) {
  for (const char* const word : {"name", "key"}) {
    const Value* const name = element.find(word);
    if (name != nullptr) return name->string;
  }
  const Value* const between = element.find("between");
  if (between == nullptr) return "?";
  std::string names;
  for (const Entry& entry : between->entries) {
    names += (names.empty() ? "" : ", ") + entry.value.string;
  }
  return names;
}

// Elements of arrays of tables by their name: layers as --set addresses them.
void flatten(const Value& value, const std::string& prefix,
             std::map<std::string, std::string>& keys) {
  const bool tables = value.kind == Value::Kind::kArray && !value.entries.empty() &&
                      value.entries.front().value.kind == Value::Kind::kTable;
  if (value.kind != Value::Kind::kTable && !tables) {
    keys[prefix] = value.text;
    return;
  }
  for (const Entry& entry : value.entries) {
    const std::string key = tables ? name_of(entry.value) : entry.key;
    flatten(entry.value, prefix.empty() ? key : prefix + "." + key, keys);
  }
}

Loaded load(const std::filesystem::path& folder) {
  Loaded run{read_run_files(folder), {}, {}};
  run.name = folder.lexically_normal().string();
  if (run.name.size() > 1 && run.name.ends_with('/')) run.name.pop_back();
  flatten(read_toml_file((folder / "config.toml").string()), "", run.keys);
  return run;
}

Trajectory trajectory_of(const RunLog& log) {
  Trajectory loop;
  for (std::size_t k = 0; k < log.cycles(); ++k) {
    loop.time_ms.push_back(1e3 * log.time_s[k]);
    loop.power_mW.push_back(1e3 * log.power_W[k]);
  }
  loop.peak_K = log.has_truth() ? log.peak_true_K : log.peak_estimate_K;
  loop.volume_K = log.has_truth() ? log.volume_true_K : log.volume_estimate_K;
  loop.absorption_factor = log.absorption_estimate;
  return loop;
}

std::string optional_text(std::optional<double> value, double factor, std::string_view unit) {
  return value ? number_text(*value * factor, unit) : "–";
}

std::string count_text(const std::optional<std::int64_t>& value) {
  return value ? fmt::format("{}", *value) : "–";
}

Html summary_table(const std::vector<Loaded>& runs) {
  Table summaries{
      .head = {"run", "highest peak", "limit", "cycles above it", "95 % after",
               "RMS error after 50 ms", "final error of alpha", "overruns", "seed", "stopped for"},
      .rows = {}};
  for (const Loaded& run : runs) {
    const RunSummary& s = run.summary;
    summaries.rows.push_back(
        {run.name,
         optional_text(s.peak_true_max_K ? s.peak_true_max_K : s.peak_estimate_max_K, 1.0, "K"),
         number_text(s.limit_K, "K"), count_text(s.limit_violations),
         optional_text(s.time_to_95_percent_s, 1e3, "ms"),
         optional_text(s.rms_error_after_50_ms_K, 1.0, "K"),
         optional_text(s.absorption_error_final, 100.0, "%"), count_text(s.overruns), s.seed,
         s.stopped_for.value_or("–")});
  }
  return section("Summaries", table(summaries, "Summaries"));
}

Html difference_table(const std::vector<Loaded>& runs) {
  const std::string_view heading = "Where the configurations differ";
  std::set<std::string> keys;
  Table differences{.head = {"key"}, .rows = {}};
  for (const Loaded& run : runs) {
    for (const auto& [key, text] : run.keys) keys.insert(key);
    differences.head.push_back(run.name);
  }
  for (const std::string& key : keys) {
    std::vector<std::string> row = {key};
    for (const Loaded& run : runs) {
      const auto found = run.keys.find(key);
      row.push_back(found == run.keys.end() ? "not given" : found->second);
    }
    if (std::set(row.begin() + 1, row.end()).size() > 1) differences.rows.push_back(row);
  }
  if (differences.rows.empty()) return section(heading, element("p", "Nowhere."));
  return section(heading, table(differences, heading));
}

}  // namespace

void compare_runs(const std::vector<std::filesystem::path>& folders,
                  const std::filesystem::path& out) {
  check_run_folder(out);
  std::vector<Loaded> runs;
  std::vector<OverlayCurve> curves;
  for (const auto& folder : folders) {
    const Loaded& run = runs.emplace_back(load(folder));
    curves.push_back({.label = run.name,
                      .loop = trajectory_of(run.log),
                      .limit_K = run.summary.limit_K,
                      .reference_K = run.config.peak_reference_K});
    if (run.log.has_truth()) curves.back().absorption_true = run.config.absorption_true;
  }
  const std::vector<Figure> figures = overlay_figures(curves);
  const PageHead head{.title = "Runs compared",
                      .kicker = "comparison",
                      .line = fmt::format("{} run folders", runs.size()),
                      .notice =
                          "One time axis for all. The peak is the true one where the eye was "
                          "simulated, else the estimate."};
  std::filesystem::create_directories(out);
  write_file((out / "compare.svg").string(), figure_svg(figures.front(), SvgKind::kStandAlone));
  write_file((out / "compare.csv").string(), figure_csv(figures.front()));
  write_file((out / "index.html").string(),
             page(head, section("Overlay", stack(figures)) + summary_table(runs) +
                            difference_table(runs)));
}

}  // namespace photocoag
