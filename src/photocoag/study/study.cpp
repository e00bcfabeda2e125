#include "photocoag/study/study.hpp"

#include "photocoag/core/error.hpp"
#include "photocoag/study/study_table.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

StudyRun read_run(const StudyTable& table) {
  table.only({"id", "label", "column", "set", "ink", "dash"});
  StudyRun run{.id = table.required("id"),
               .label = table.text("label"),
               .column = table.text("column"),
               .set = table.texts("set"),
               .ink = table.integer("ink", 1),
               .dash = table.text("dash", "solid")};
  if (run.label.empty()) run.label = run.id;
  if (run.ink < 1 || run.ink > 6) table.refuse_key("ink", "1 to 6");
  if (run.dash != "solid" && run.dash != "dashed" && run.dash != "dotted") {
    table.refuse_key("dash", "solid, dashed or dotted");
  }
  return run;
}

Claim read_claim(const StudyTable& table) {
  table.only(
      {"text", "holds_if", "in_truth", "differs", "cannot_judge", "needs", "expected", "whose"});
  Claim claim{.text = table.required("text"),
              .holds_if = table.text("holds_if"),
              .in_truth = table.text("in_truth"),
              .differs = table.text("differs"),
              .cannot_judge = table.text("cannot_judge"),
              .needs = table.text("needs"),
              .expected = table.text("expected"),
              .ours = table.text("whose", "paper") == "ours"};
  // What needs a run that may be missing says what then.
  if (claim.needs.empty() ? claim.holds_if.empty() == claim.cannot_judge.empty()
                          : claim.holds_if.empty() || claim.cannot_judge.empty()) {
    throw Error(ErrorParts{.key = "claim",
                           .problem = "needs either holds_if or cannot_judge; both with needs",
                           .found = claim.text});
  }
  if (const std::string whose = table.text("whose", "paper"); whose != "paper" && whose != "ours") {
    table.refuse_key("whose", "paper or ours");
  }
  if (!claim.expected.empty() && claim.expected != "holds" && claim.expected != "differs" &&
      claim.expected != "undecided") {
    table.refuse_key("expected", "holds, differs or undecided");
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
  const StudyTable table(root, "");
  table.only({"kind", "title", "paper", "note", "base", "set", "view_ms", "draw", "difference_from",
              "horizons", "column", "run", "claim"});
  Study study{.id = file.stem().string(),
              .file = file,
              .kind = StudyKind::kClosedLoop,
              .title = table.required("title"),
              .paper = table.required("paper"),
              .note = table.text("note"),
              .base = {},
              .set = table.texts("set"),
              .view_ms = table.number("view_ms").value_or(60.0),
              .experiment = table.text("draw", "truth") == "estimate",
              .difference_from = table.text("difference_from"),
              .horizons = table.integers("horizons"),
              .columns = {},
              .runs = {},
              .claims = {}};
  if (const std::string draw = table.text("draw", "truth"); draw != "truth" && draw != "estimate") {
    table.refuse_key("draw", "truth or estimate");
  }
  const std::string kind = table.text("kind", "closed-loop");
  if (kind == "computation-times") {
    study.kind = StudyKind::kComputationTimes;
  } else if (kind != "closed-loop") {
    table.refuse_key("kind", "closed-loop or computation-times");
  }
  if (const std::string base = table.text("base"); !base.empty()) {
    study.base = (file.parent_path() / base).lexically_normal().string();
  }
  for (const StudyTable& column : table.tables("column")) {
    column.only({"id", "title", "set"});
    study.columns.push_back({column.required("id"), column.required("title"), column.texts("set")});
  }
  for (const StudyTable& run : table.tables("run")) study.runs.push_back(read_run(run));
  try {
    for (const StudyTable& claim : table.tables("claim")) study.claims.push_back(read_claim(claim));
  } catch (const Error& error) {
    throw error.at(file.string());
  }
  return study;
}

Plan load_plan(const fs::path& file) {
  const Value root = read_toml_file(file.string());
  const StudyTable table(root, "");
  table.only({"studies", "seeds", "variation_seeds", "variation"});
  Plan plan{.studies = table.texts("studies"),
            .seeds = table.integer("seeds", 20),
            .variation_seeds = table.integer("variation_seeds", 4),
            .variations = {}};
  for (const StudyTable& variation : table.tables("variation")) {
    variation.only({"id", "title", "set"});
    plan.variations.push_back(
        {variation.required("id"), variation.required("title"), variation.texts("set")});
  }
  return plan;
}

}  // namespace photocoag
