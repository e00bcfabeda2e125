// Role: offline; every table and figure of the paper's results on the simulated eye, with a verdict
// on each claim of the paper's text. Used by `photocoag reproduce`.
// Source: paper, sections 3 to 6. Differences: simulated eyes where the paper has porcine ones.
// Units: in the names. Real-time promise: none.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/page/figure.hpp"
#include "photocoag/study/expression.hpp"
#include "photocoag/study/run_set.hpp"
#include "photocoag/study/study.hpp"

namespace photocoag {

/// kUndecided: other seeds may give another verdict. The predicate is true in less than 97.5 % and
/// in more than 2.5 % of the draws of the seeds with replacement (evaluate_predicate).
enum class ClaimVerdict { kHolds, kDiffers, kUndecided, kCannotJudge };
inline constexpr std::size_t kClaimVerdicts = 4;

std::string_view name_of(ClaimVerdict verdict) noexcept;

struct JudgedClaim {
  Claim claim;
  ClaimVerdict verdict = ClaimVerdict::kCannotJudge;
  std::vector<TermValue> terms;          ///< the measured numbers behind it
  std::optional<ClaimVerdict> in_truth;  ///< of an experiment: by the true temperatures
  std::vector<TermValue> truth_terms;
  bool other_seeds =
      false;  ///< another number of seeds than the plan's, for which the file's verdict holds

  /// True if the verdict is the one expected by the study's file, or none is expected. With another
  /// number of seeds: if it is not the opposite.
  bool as_expected() const noexcept;
};

/// Verdicts under one variation of what the paper does not give, in the order of the claims.
struct VariedStudy {
  Variation variation;
  std::vector<ClaimVerdict> verdicts;
};

struct StudyOutcome {
  Study study;
  int seeds = 0;
  std::vector<RunResult> results;
  std::vector<JudgedClaim> claims;
  std::vector<VariedStudy> variations;
};

/// Throws Error naming the study's file if a predicate is malformed.
JudgedClaim judge_claim(const Study& study, const Claim& claim,
                        const std::vector<RunResult>& results);

/// Runs a study over `seeds` and judges its claims. `extra`: a variation's overrides, applied last;
/// it may refuse a run that a claim `needs`, which cannot be judged then.
StudyOutcome run_study(const Study& study, const std::vector<std::string>& extra, int seeds,
                       ModelPool& pool, const Progress& progress = {});

struct ReproduceOptions {
  std::filesystem::path studies;  ///< folder with plan.toml and the studies
  std::filesystem::path out;      ///< folder, new or empty
  bool quick = false;             ///< no sensitivities
  int seeds = 0;                  ///< noise seeds per closed loop; 0: the plan's
  bool use_cache = true;
};

/// Runs everything and writes index.html, claims.json, and an SVG and a CSV per figure. Throws
/// Error.
std::vector<StudyOutcome> reproduce(const ReproduceOptions& options, const Progress& progress = {});

/// One file of a reproduction, beside index.html.
struct StudyFile {
  std::string name;
  std::string content;
};

/// A figure of a study for the page, and its files.
struct StudyDrawing {
  std::string title;
  Figure figure;
  std::string svg_file, csv_file;
};

/// Figures of one study: one per column. `files` gets SVG and CSV.
std::vector<StudyDrawing> draw_study(const StudyOutcome& outcome, std::vector<StudyFile>& files);

/// The self-contained page.
std::string reproduce_page(const std::vector<StudyOutcome>& outcomes,
                           const std::vector<std::vector<StudyDrawing>>& drawings, bool quick);

/// Every claim with numbers and verdict.
std::string claims_json(const std::vector<StudyOutcome>& outcomes, bool quick);

}  // namespace photocoag
