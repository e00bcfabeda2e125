#include "photocoag/study/study.hpp"

#include "photocoag/config/table_reader.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

StudyRun read_run(const TableReader& table) {
  table.only({"id", "label", "column", "set", "ink", "dash"});
  StudyRun run{.id = table.required_text("id"),
               .label = table.text("label"),
               .column = table.text("column"),
               .set = table.texts("set"),
               .ink = table.integer("ink", 1, 6, 1),
               .dash = table.word("dash", {"solid", "dashed", "dotted"}, "solid")};
  if (run.label.empty()) run.label = run.id;
  return run;
}

Claim read_claim(const TableReader& table) {
  table.only(
      {"text", "holds_if", "in_truth", "differs", "cannot_judge", "needs", "expected", "whose"});
  Claim claim{.text = table.required_text("text"),
              .holds_if = table.text("holds_if"),
              .in_truth = table.text("in_truth"),
              .differs = table.text("differs"),
              .cannot_judge = table.text("cannot_judge"),
              .needs = table.text("needs"),
              .expected = table.word("expected", {"holds", "differs", "undecided"}, ""),
              .ours = table.word("whose", {"paper", "ours"}, "paper") == "ours"};
  // A claim that needs an optional run must say why it cannot be judged without it.
  if (claim.needs.empty() ? claim.holds_if.empty() == claim.cannot_judge.empty()
                          : claim.holds_if.empty() || claim.cannot_judge.empty()) {
    throw Error(ErrorParts{.key = "claim",
                           .problem = "needs either holds_if or cannot_judge; both with needs",
                           .found = claim.text});
  }
  return claim;
}

}  // namespace

std::vector<std::string> Study::overrides(const StudyRun& run) const {
  std::vector<std::string> all = set;
  for (const StudyColumn& column : columns) {
    if (column.id == run.column) all.insert(all.end(), column.set.begin(), column.set.end());
  }
  all.insert(all.end(), run.set.begin(), run.set.end());
  return all;
}

Study load_study(const fs::path& file) {
  const Value root = read_toml_file(file.string());
  const TableReader table(root, "");
  table.only({"kind", "title", "paper", "note", "base", "set", "view_ms", "draw", "difference_from",
              "horizons", "column", "run", "claim"});
  Study study{.id = file.stem().string(),
              .file = file,
              .kind = StudyKind::kClosedLoop,
              .title = table.required_text("title"),
              .paper = table.required_text("paper"),
              .note = table.text("note"),
              .base = {},
              .set = table.texts("set"),
              .view_ms = table.number("view_ms").value_or(60.0),
              .experiment = table.word("draw", {"truth", "estimate"}, "truth") == "estimate",
              .difference_from = table.text("difference_from"),
              .horizons = table.integers("horizons"),
              .columns = {},
              .runs = {},
              .claims = {}};
  if (table.word("kind", {"closed-loop", "computation-times"}, "closed-loop") != "closed-loop") {
    study.kind = StudyKind::kComputationTimes;
  }
  if (const std::string base = table.text("base"); !base.empty()) {
    study.base = (file.parent_path() / base).lexically_normal().string();
  }
  for (const TableReader& column : table.tables("column")) {
    column.only({"id", "title", "set"});
    study.columns.push_back(
        {column.required_text("id"), column.required_text("title"), column.texts("set")});
  }
  for (const TableReader& run : table.tables("run")) study.runs.push_back(read_run(run));
  try {
    for (const TableReader& claim : table.tables("claim"))
      study.claims.push_back(read_claim(claim));
  } catch (const Error& error) {
    throw error.at(file.string());
  }
  return study;
}

Plan load_plan(const fs::path& file) {
  const Value root = read_toml_file(file.string());
  const TableReader table(root, "");
  table.only({"studies", "seeds", "variation_seeds", "variation"});
  Plan plan{.studies = table.texts("studies"),
            .seeds = table.integer("seeds", 0, 1000, 20),
            .variation_seeds = table.integer("variation_seeds", 0, 1000, 4),
            .variations = {}};
  for (const TableReader& variation : table.tables("variation")) {
    variation.only({"id", "title", "set"});
    plan.variations.push_back(
        {variation.required_text("id"), variation.required_text("title"), variation.texts("set")});
  }
  return plan;
}

}  // namespace photocoag
