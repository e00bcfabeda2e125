// Role: offline; one figure or table of the paper as a file (studies/*.toml): runs, figures, and
// claims, each with the predicate that decides it. Used by reproduce. Format: docs/studies.md.
// Units: in the names. Real-time promise: none.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace photocoag {

/// One curve: a configuration, run over all seeds.
struct StudyRun {
  std::string id;
  std::string label;
  std::string column;            ///< id of the column it is drawn in; empty: not drawn
  std::vector<std::string> set;  ///< after the study's and the column's
  int ink = 1;                   ///< 1 to 6
  std::string dash = "solid";
};

struct StudyColumn {
  std::string id;
  std::string title;
  std::vector<std::string> set;
};

struct Claim {
  std::string text;               ///< paraphrase of the paper's statement
  std::string holds_if = {};      ///< predicate; empty: cannot be judged here
  std::string in_truth = {};      ///< of an experiment: the same on the true temperatures
  std::string differs = {};       ///< how and why, should the predicate be false
  std::string cannot_judge = {};  ///< why not
  std::string needs = {};         ///< id of a run that some builds or variations do not have
  std::string expected = {};  ///< "holds", "differs", "undecided"; empty: depends on the machine
  bool ours = false;          ///< not the paper's
};

enum class StudyKind { kClosedLoop, kComputationTimes };

struct Study {
  std::string id;  ///< the file's name without .toml
  std::filesystem::path file;
  StudyKind kind = StudyKind::kClosedLoop;
  std::string title;
  std::string paper;  ///< location of the figure or table in the paper
  std::string note;   ///< our additions and assumptions
  std::string base;   ///< configuration file; empty: the defaults
  std::vector<std::string> set;
  double view_ms = 60.0;
  bool experiment = false;      ///< draw the estimate, as observed in the experiment
  std::string difference_from;  ///< end of the id of the run to draw the differences from; or empty
  std::vector<int> horizons;    ///< of a table of computation times
  std::vector<StudyColumn> columns;
  std::vector<StudyRun> runs;
  std::vector<Claim> claims;

  /// All overrides of a run in their order.
  std::vector<std::string> overrides(const StudyRun& run) const;
};

/// A variation of what the paper does not give: overrides that apply to every run.
struct Variation {
  std::string id;
  std::string title;
  std::vector<std::string> set;
};

/// The closing page.
struct Plan {
  std::vector<std::string> studies;  ///< ids, in the page's order
  int seeds = 20;
  int variation_seeds = 4;
  std::vector<Variation> variations;
};

/// Throws Error naming file, line, key, what was found and what is accepted.
Study load_study(const std::filesystem::path& file);
Plan load_plan(const std::filesystem::path& file);

}  // namespace photocoag
