// The file of a search.
#include <fmt/format.h>

#include <algorithm>

#include "photocoag/config/table_reader.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/study/explain.hpp"

namespace photocoag {
namespace {

LabelledSet read_set(const TableReader& table) {
  return {table.required_text("label"), table.texts("set")};
}

std::vector<LabelledSet> read_sets(const TableReader& table, std::string_view name) {
  std::vector<LabelledSet> all;
  for (const TableReader& one : table.tables(name)) {
    one.only({"label", "set"});
    all.push_back(read_set(one));
  }
  return all;
}

Factor read_factor(const TableReader& table) {
  table.only({"id", "title", "change", "level"});
  Factor factor{.id = table.required_text("id"),
                .title = table.required_text("title"),
                .combined = table.word("change", {"combined", "alone"}, "combined") == "combined",
                .levels = read_sets(table, "level")};
  if (factor.levels.size() < 2) {
    throw Error(ErrorParts{.key = "factor.level",
                           .found = fmt::format("{} of {}", factor.levels.size(), factor.id),
                           .accepted = "at least two, the default first"});
  }
  return factor;
}

RemedyPlan read_remedy(const TableReader& table) {
  table.only({"label", "set", "told", "more"});
  return {.does = read_set(table),
          .told_found_lag = table.word("told", {"found"}, "") == "found",
          .more = table.number("more", 0.0, 1.0).value_or(0.0)};
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

void read_lists(const TableReader& table, Explanation& study) {
  for (const TableReader& run : table.tables("run")) {
    run.only({"id", "label", "set"});
    StudyRun& one = study.runs.emplace_back();
    one.id = run.required_text("id");
    one.label = run.text("label", one.id);
    one.set = run.texts("set");
  }
  for (const TableReader& statement : table.tables("statement")) {
    statement.only({"text", "holds_if", "in_truth"});
    study.statements.push_back({.text = statement.required_text("text"),
                                .holds_if = statement.required_text("holds_if"),
                                .in_truth = statement.text("in_truth")});
  }
  for (const TableReader& factor : table.tables("factor")) {
    study.factors.push_back(read_factor(factor));
  }
  for (const TableReader& scan : table.tables("scan")) {
    scan.only({"title", "set", "key", "values"});
    study.scans.push_back({scan.required_text("title"), scan.texts("set"),
                           scan.required_text("key"), scan.numbers("values")});
  }
  for (const TableReader& remedy : table.tables("remedy")) {
    study.remedies.push_back(read_remedy(remedy));
  }
}

}  // namespace

Explanation load_explanation(const std::filesystem::path& file) {
  const Value root = read_toml_file(file.string());
  const TableReader table(root, "");
  table.only({"title", "note", "set", "seeds", "confirm_seeds", "best_sets", "lag_run", "hot_run",
              "scan_factor", "lags", "run", "statement", "factor", "scan", "candidate", "remedy"});
  Explanation study;
  study.file = file;
  study.title = table.required_text("title");
  study.note = table.text("note");
  study.set = table.texts("set");
  study.seeds = std::max(1, table.integer("seeds", 0, 1000, study.seeds));
  study.confirm_seeds = std::max(1, table.integer("confirm_seeds", 0, 1000, study.confirm_seeds));
  study.best_sets = std::max(1, table.integer("best_sets", 0, 1000, study.best_sets));
  study.lag_run = table.required_text("lag_run");
  study.hot_run = table.required_text("hot_run");
  study.scan_factor = table.required_text("scan_factor");
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
