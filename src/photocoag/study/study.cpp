#include "photocoag/study/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <string_view>

#include "photocoag/config/source.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

// A table of the file; every key read is known, the others are errors.
class Table {
 public:
  Table(const Value& value, std::string name) : value_(value), name_(std::move(name)) {
    if (value.kind != Value::Kind::kTable) refuse(value, name_, "a table");
  }

  void only(std::initializer_list<std::string_view> keys) const {
    for (const Entry& entry : value_.entries) {
      if (std::find(keys.begin(), keys.end(), entry.key) == keys.end()) {
        throw Error(ErrorParts{.where = entry.value.where,
                               .key = key(entry.key),
                               .problem = "unknown key",
                               .accepted = fmt::format("{}", fmt::join(keys, ", "))});
      }
    }
  }
  std::string text(std::string_view name, std::string otherwise = {}) const {
    const Value* found = value_.find(name);
    if (found == nullptr) return otherwise;
    if (found->kind != Value::Kind::kString) refuse(*found, key(name), "a string");
    return found->string;
  }
  std::string required(std::string_view name) const {
    if (value_.find(name) == nullptr) {
      throw Error(
          ErrorParts{.where = value_.where, .key = key(name), .problem = "the key is missing"});
    }
    return text(name);
  }
  std::optional<double> number(std::string_view name) const {
    const Value* found = value_.find(name);
    if (found == nullptr) return {};
    return number_of(*found, key(name));
  }
  int integer(std::string_view name, int otherwise) const {
    const Value* found = value_.find(name);
    if (found == nullptr) return otherwise;
    if (found->kind != Value::Kind::kInteger || found->integer < 0 || found->integer > 1000) {
      refuse(*found, key(name), "a whole number from 0 to 1000");
    }
    return static_cast<int>(found->integer);
  }
  std::vector<std::string> texts(std::string_view name) const {
    std::vector<std::string> all;
    for (const Value* item : items(name)) {
      if (item->kind != Value::Kind::kString) refuse(*item, key(name), "strings");
      all.push_back(item->string);
    }
    return all;
  }
  std::vector<int> integers(std::string_view name) const {
    std::vector<int> all;
    for (const Value* item : items(name)) {
      if (item->kind != Value::Kind::kInteger) refuse(*item, key(name), "whole numbers");
      all.push_back(static_cast<int>(item->integer));
    }
    return all;
  }
  std::vector<Table> tables(std::string_view name) const {
    std::vector<Table> all;
    for (const Value* item : items(name)) all.emplace_back(*item, std::string(name));
    return all;
  }
  [[noreturn]] void refuse_key(std::string_view name, std::string accepted) const {
    refuse(*value_.find(name), key(name), std::move(accepted));
  }

 private:
  std::string key(std::string_view name) const {
    return name_.empty() ? std::string(name) : fmt::format("{}.{}", name_, name);
  }
  std::vector<const Value*> items(std::string_view name) const {
    std::vector<const Value*> all;
    const Value* found = value_.find(name);
    if (found == nullptr) return all;
    if (found->kind != Value::Kind::kArray) refuse(*found, key(name), "an array");
    for (const Entry& entry : found->entries) all.push_back(&entry.value);
    return all;
  }
  static double number_of(const Value& value, const std::string& key) {
    if (value.kind == Value::Kind::kInteger) return static_cast<double>(value.integer);
    if (value.kind != Value::Kind::kFloat) refuse(value, key, "a number");
    return value.number;
  }
  [[noreturn]] static void refuse(const Value& value, std::string key, std::string accepted) {
    throw Error(ErrorParts{.where = value.where,
                           .key = std::move(key),
                           .found = value.text,
                           .accepted = std::move(accepted)});
  }

  const Value& value_;
  std::string name_;
};

StudyRun read_run(const Table& table) {
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

Claim read_claim(const Table& table) {
  table.only({"text", "holds_if", "differs", "cannot_judge", "expected"});
  Claim claim{.text = table.required("text"),
              .holds_if = table.text("holds_if"),
              .differs = table.text("differs"),
              .cannot_judge = table.text("cannot_judge"),
              .expected = table.text("expected")};
  if (claim.holds_if.empty() == claim.cannot_judge.empty()) {
    throw Error(ErrorParts{
        .key = "claim", .problem = "needs either holds_if or cannot_judge", .found = claim.text});
  }
  if (!claim.expected.empty() && claim.expected != "holds" && claim.expected != "differs") {
    table.refuse_key("expected", "holds or differs");
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
  const Table table(root, "");
  table.only({"kind", "title", "paper", "note", "base", "set", "view_ms", "horizons", "column",
              "run", "claim"});
  Study study{.id = file.stem().string(),
              .file = file,
              .kind = StudyKind::kClosedLoop,
              .title = table.required("title"),
              .paper = table.required("paper"),
              .note = table.text("note"),
              .base = {},
              .set = table.texts("set"),
              .view_ms = table.number("view_ms").value_or(60.0),
              .horizons = table.integers("horizons"),
              .columns = {},
              .runs = {},
              .claims = {}};
  const std::string kind = table.text("kind", "closed-loop");
  if (kind == "computation-times") {
    study.kind = StudyKind::kComputationTimes;
  } else if (kind != "closed-loop") {
    table.refuse_key("kind", "closed-loop or computation-times");
  }
  if (const std::string base = table.text("base"); !base.empty()) {
    study.base = (file.parent_path() / base).lexically_normal().string();
  }
  for (const Table& column : table.tables("column")) {
    column.only({"id", "title", "set"});
    study.columns.push_back({column.required("id"), column.required("title"), column.texts("set")});
  }
  for (const Table& run : table.tables("run")) study.runs.push_back(read_run(run));
  try {
    for (const Table& claim : table.tables("claim")) study.claims.push_back(read_claim(claim));
  } catch (const Error& error) {
    throw error.at(file.string());
  }
  return study;
}

Plan load_plan(const fs::path& file) {
  const Value root = read_toml_file(file.string());
  const Table table(root, "");
  table.only({"studies", "seeds", "variation_seeds", "variation"});
  Plan plan{.studies = table.texts("studies"),
            .seeds = table.integer("seeds", 20),
            .variation_seeds = table.integer("variation_seeds", 4),
            .variations = {}};
  for (const Table& variation : table.tables("variation")) {
    variation.only({"id", "title", "set"});
    plan.variations.push_back(
        {variation.required("id"), variation.required("title"), variation.texts("set")});
  }
  return plan;
}

}  // namespace photocoag
