// The file of a search.
#include <fmt/format.h>

#include <algorithm>

#include "photocoag/core/error.hpp"
#include "photocoag/study/explain.hpp"
#include "photocoag/study/study_table.hpp"

namespace photocoag {
namespace {

LabelledSet read_set(const StudyTable& table) {
  return {table.required("label"), table.texts("set")};
}

std::vector<LabelledSet> read_sets(const StudyTable& table, std::string_view name) {
  std::vector<LabelledSet> all;
  for (const StudyTable& one : table.tables(name)) {
    one.only({"label", "set"});
    all.push_back(read_set(one));
  }
  return all;
}

Factor read_factor(const StudyTable& table) {
  table.only({"id", "title", "change", "level"});
  const std::string change = table.text("change", "combined");
  if (change != "combined" && change != "alone") table.refuse_key("change", "combined or alone");
  Factor factor{.id = table.required("id"),
                .title = table.required("title"),
                .combined = change == "combined",
                .levels = read_sets(table, "level")};
  if (factor.levels.size() < 2) {
    throw Error(ErrorParts{.key = "factor.level",
                           .found = fmt::format("{} of {}", factor.levels.size(), factor.id),
                           .accepted = "at least two, the default first"});
  }
  return factor;
}

RemedyPlan read_remedy(const StudyTable& table) {
  table.only({"label", "set", "told", "more"});
  const std::string told = table.text("told");
  if (!told.empty() && told != "found") table.refuse_key("told", "found");
  const double more = table.number("more").value_or(0.0);
  if (more < 0.0 || more > 1.0) table.refuse_key("more", "a number from 0 to 1 periods");
  return {.does = read_set(table), .told_found_lag = told == "found", .more = more};
}

// A key that has to name one of the study's own runs or factors.
template <typename All>
void need_one_of(const All& all, const std::string& id, const char* key) {
  std::vector<std::string> known;
  for (const auto& one : all) known.push_back(one.id);
  if (std::find(known.begin(), known.end(), id) != known.end()) return;
  throw Error(
      ErrorParts{.key = key, .found = id, .accepted = fmt::format("{}", fmt::join(known, ", "))});
}

void read_lists(const StudyTable& table, Explanation& study) {
  for (const StudyTable& run : table.tables("run")) {
    run.only({"id", "label", "set"});
    StudyRun& one = study.runs.emplace_back();
    one.id = run.required("id");
    one.label = run.text("label", one.id);
    one.set = run.texts("set");
  }
  for (const StudyTable& statement : table.tables("statement")) {
    statement.only({"text", "holds_if", "in_truth"});
    study.statements.push_back({.text = statement.required("text"),
                                .holds_if = statement.required("holds_if"),
                                .in_truth = statement.text("in_truth")});
  }
  for (const StudyTable& factor : table.tables("factor")) {
    study.factors.push_back(read_factor(factor));
  }
  for (const StudyTable& scan : table.tables("scan")) {
    scan.only({"title", "set", "key", "values"});
    study.scans.push_back(
        {scan.required("title"), scan.texts("set"), scan.required("key"), scan.numbers("values")});
  }
  for (const StudyTable& remedy : table.tables("remedy")) {
    study.remedies.push_back(read_remedy(remedy));
  }
}

}  // namespace

Explanation load_explanation(const std::filesystem::path& file) {
  const Value root = read_toml_file(file.string());
  const StudyTable table(root, "");
  table.only({"title", "note", "set", "seeds", "confirm_seeds", "best_sets", "lag_run", "hot_run",
              "scan_factor", "lags", "run", "statement", "factor", "scan", "candidate", "remedy"});
  Explanation study;
  study.file = file;
  study.title = table.required("title");
  study.note = table.text("note");
  study.set = table.texts("set");
  study.seeds = std::max(1, table.integer("seeds", study.seeds));
  study.confirm_seeds = std::max(1, table.integer("confirm_seeds", study.confirm_seeds));
  study.best_sets = std::max(1, table.integer("best_sets", study.best_sets));
  study.lag_run = table.required("lag_run");
  study.hot_run = table.required("hot_run");
  study.scan_factor = table.required("scan_factor");
  study.lags = table.numbers("lags");
  study.candidates = read_sets(table, "candidate");
  try {
    read_lists(table, study);
    need_one_of(study.runs, study.lag_run, "lag_run");
    need_one_of(study.runs, study.hot_run, "hot_run");
    need_one_of(study.factors, study.scan_factor, "scan_factor");
    if (study.statements.empty() || study.lags.empty()) {
      throw Error(ErrorParts{.key = study.lags.empty() ? "lags" : "statement",
                             .found = "none",
                             .accepted = "at least one"});
    }
  } catch (const Error& error) {
    throw error.at(file.string());
  }
  return study;
}

}  // namespace photocoag
