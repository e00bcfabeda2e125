// Role: offline; searches for a bench, eye and tuning that reproduce the paper's experiments: over
// what the paper does not give, judged by the statements in its text. Used by `photocoag explain`.
// Source: paper, section 4.2; the file studies/experiments/NAME.toml, format in docs/studies.md.
// Difference: the eyes are simulated. Units: in the names; lags in periods. Real-time promise:
// none.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "photocoag/study/run_set.hpp"
#include "photocoag/study/study.hpp"

namespace photocoag {

/// Overrides with a label.
struct LabelledSet {
  std::string label;
  std::vector<std::string> set;
};

/// An unknown of the paper; its first level is the default.
struct Factor {
  std::string id;
  std::string title;
  bool combined = true;  ///< false: only changed alone
  std::vector<LabelledSet> levels;
};

/// A line of the sensitivity figure: a key over these values, at each level of a factor.
struct Scan {
  std::string title;
  std::vector<std::string> set;  ///< on top of the best set, before the key
  std::string key;
  std::vector<double> values;
};

/// A remedy for the best set's bench.
struct RemedyPlan {
  LabelledSet does;
  bool told_found_lag =
      false;  ///< the estimator gets the lag found by replaying one treatment of the same seed
  double more = 0.0;  ///< periods, added to that lag; the sum at most 1
};

struct Explanation {
  std::filesystem::path file;
  std::string title, note;
  std::vector<std::string> set;
  int seeds = 4;  ///< repetitions of every set of the search
  int confirm_seeds =
      100;  ///< repetitions of the best sets and candidates, with other seeds than the search's
  int best_sets = 4;  ///< how many are confirmed
  std::vector<StudyRun> runs;
  std::string lag_run;  ///< id: replayed to find the lag
  std::string hot_run;  ///< id: the one that exceeds the limit
  std::vector<Claim> statements;
  std::vector<Factor> factors;
  std::string scan_factor;  ///< id
  std::vector<Scan> scans;
  std::vector<double> lags;             ///< periods, of the filters that replay
  std::vector<LabelledSet> candidates;  ///< confirmed whatever the search finds
  std::vector<RemedyPlan> remedies;
};

/// Throws Error naming file, line, key, what was found and what is accepted.
Explanation load_explanation(const std::filesystem::path& file);

/// Statements over repeated experiments: every treatment has its own noise, and a repetition
/// consists of one of each, as in the paper.
struct Repetitions {
  std::vector<std::vector<bool>> seen;   ///< by statement and repetition, as observed
  std::vector<std::vector<bool>> truth;  ///< the same on the truth, where a statement has one

  std::size_t count() const { return seen.empty() ? 0 : seen.front().size(); }
  double share(std::size_t statement) const;          ///< of the repetitions in which it holds
  double true_share(std::size_t statement) const;     ///< by the truth
  double mean_held() const;                           ///< statements that hold in one repetition
  std::size_t with_at_least(std::size_t held) const;  ///< repetitions with so many
};

/// One set of levels, by index, one per factor.
struct ExplainedPoint {
  std::vector<std::size_t> levels;
  Repetitions repetitions;
  std::size_t changed = 0;  ///< factors that are not at their default
};

struct ScanPoint {
  double value = 0.0;
  double mean_held = 0.0;
  double dip_percent = 0.0;      ///< of the estimated absorption in hot_run; medians over the seeds
  double over_estimate_K = 0.0;  ///< of hot_run over the limit
  double over_true_K = 0.0;
};

/// Which temperature of an experiment is read as the peak.
enum class PeakReading {
  kEstimate,    ///< the filter's after each sample, as the controller uses it
  kPrediction,  ///< the filter's before each sample
  kAfterwards,  ///< the model's under the recorded powers with the last estimate of alpha
};
inline constexpr std::size_t kReadings = 3;

/// Result of one reading for a set.
struct ReadResult {
  Repetitions repetitions;
  std::vector<double> over_K;  ///< hot_run over the limit, one per repetition
};

/// A set with many repetitions.
struct ConfirmedSet {
  std::string label;
  std::vector<RunResult> runs;
  std::vector<ReadResult> readings;  ///< by PeakReading
  std::vector<double> over_true_K;
  double true_lag = 0.0;           ///< of the sample's middle, beyond the estimator's lag
  std::vector<double> lag_misfit;  ///< of the lags: mean squared innovation in its variance, median
  std::vector<double> found_lags;  ///< of the least misfit, one per repetition

  const Repetitions& repetitions() const { return readings.front().repetitions; }
};

struct Remedy {
  std::string label;
  double estimate_K = 0.0;  ///< largest over the seeds
  double true_K = 0.0;
  double held_K = 0.0;         ///< from the reference, mean over the seeds, after 50 ms
  double time_to_95_ms = 0.0;  ///< median
  std::size_t over = 0;        ///< seeds with a true peak above the limit
};

struct ExplainOutcome {
  Explanation study;
  std::vector<ExplainedPoint> alone;     ///< one factor changed, the default first
  std::vector<ExplainedPoint> together;  ///< all combinations, best first
  std::vector<ExplainedPoint> around;    ///< the best set, then one factor of it changed
  std::vector<std::vector<std::vector<ScanPoint>>> scans;  ///< by scan, level of scan_factor, value
  std::vector<ConfirmedSet> confirmed;  ///< best first, the search's others, the candidates
  std::vector<Remedy> remedies;         ///< on the bench of confirmed.front()
};

/// Runs the search, confirms, finds lags, tries the remedies. `quick`: few repetitions, no
/// sensitivity. Throws Error.
ExplainOutcome explain(const Explanation& study, bool quick, bool use_cache,
                       const Progress& progress = {});

/// Runs `set` on top of the study's, seeds from `first_seed` on, and judges the repetitions.
ConfirmedSet confirm(const Explanation& study, const LabelledSet& set, int seeds, ModelPool& pool);

/// Mean squared normalized innovation of a filter with a given sample lag, periods, that replays a
/// run; `peaks` receives its predictions of the peak before each sample, K. Throws Error on bad
/// settings.
double replay_misfit(const ReducedModel& model, EstimatorSettings settings, double lag,
                     const Trajectory& run, std::vector<double>* peaks = nullptr);

/// The run with its estimated peaks as read, and the measures of that.
RunResult reread(const RunResult& run, PeakReading reading, const ReducedModel& model);

/// The remedies on the bench of `best`, whose overrides are `set`.
std::vector<Remedy> try_remedies(const Explanation& study, const std::vector<std::string>& set,
                                 const ConfirmedSet& best, ModelPool& pool);

/// Text: the levels that differ from `others`.
std::string words_of(const Explanation& study, const std::vector<std::size_t>& levels,
                     const std::vector<std::size_t>& others);

/// The configurations of the study's runs with `set`, repetitions from `first` on.
std::vector<RunJob> explained_jobs(const Explanation& study, const std::vector<std::string>& set,
                                   int first);

/// Evaluates the statements in each repetition. Throws Error naming a malformed predicate.
Repetitions judge_repetitions(const Explanation& study, const std::vector<RunResult>& results);

/// Every set of the search, a row each: levels, mean, and each statement's shares.
std::string sets_csv(const ExplainOutcome& outcome);
/// The confirmed sets and the remedies.
std::string explanation_json(const ExplainOutcome& outcome);
/// index.html, sets.csv, explanation.json and the figures in `folder`, new or empty.
void write_explanation(const std::filesystem::path& folder, const ExplainOutcome& outcome);

}  // namespace photocoag
