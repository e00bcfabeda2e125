#include "photocoag/study/explain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "photocoag/core/error.hpp"
#include "photocoag/study/expression.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kSetsAtOnce = 24;            // their trajectories are in memory together
constexpr std::uint64_t kTreatmentSeeds = 10'000;  // apart: every treatment has noise of its own

using Levels = std::vector<std::size_t>;
using Stage = std::function<void(double)>;

std::vector<std::string> overrides_of(const Explanation& study, const Levels& levels) {
  std::vector<std::string> all;
  for (std::size_t f = 0; f < levels.size(); ++f) {
    const std::vector<std::string>& set = study.factors[f].levels[levels[f]].set;
    all.insert(all.end(), set.begin(), set.end());
  }
  return all;
}

// Runs every set of overrides and hands out its results, one set after the other.
void run_sets(const Explanation& study, const std::vector<std::vector<std::string>>& sets,
              ModelPool& pool, const Stage& tell,
              const std::function<void(std::size_t, const std::vector<RunResult>&)>& take) {
  const auto runs = static_cast<std::ptrdiff_t>(study.runs.size());
  for (std::size_t first = 0; first < sets.size(); first += kSetsAtOnce) {
    const std::size_t end = std::min(sets.size(), first + kSetsAtOnce);
    std::vector<RunJob> jobs;
    for (std::size_t k = first; k < end; ++k) {
      for (RunJob& job : explained_jobs(study, sets[k], 0)) jobs.push_back(std::move(job));
    }
    std::vector<RunResult> results = run_all(jobs, study.seeds, pool);
    auto next = results.begin();
    for (std::size_t k = first; k < end; ++k, next += runs) {
      take(k, {std::make_move_iterator(next), std::make_move_iterator(next + runs)});
    }
    tell(static_cast<double>(end) / static_cast<double>(sets.size()));
  }
}

std::vector<ExplainedPoint> judge_points(const Explanation& study, const std::vector<Levels>& all,
                                         ModelPool& pool, const Stage& tell) {
  std::vector<ExplainedPoint> points(all.size());
  std::vector<std::vector<std::string>> sets;
  for (std::size_t k = 0; k < all.size(); ++k) {
    points[k].levels = all[k];
    points[k].changed = static_cast<std::size_t>(
        std::count_if(all[k].begin(), all[k].end(), [](std::size_t l) { return l != 0; }));
    sets.push_back(overrides_of(study, all[k]));
  }
  run_sets(study, sets, pool, tell, [&](std::size_t k, const std::vector<RunResult>& runs) {
    points[k].repetitions = judge_repetitions(study, runs);
  });
  return points;
}

// The set itself, then each factor at each of its other levels.
std::vector<Levels> neighbours(const Explanation& study, const Levels& levels) {
  std::vector<Levels> all = {levels};
  for (std::size_t f = 0; f < study.factors.size(); ++f) {
    for (std::size_t l = 0; l < study.factors[f].levels.size(); ++l) {
      if (l == levels[f]) continue;
      all.push_back(levels);
      all.back()[f] = l;
    }
  }
  return all;
}

std::vector<Levels> combinations(const Explanation& study) {
  std::vector<Levels> all = {Levels(study.factors.size(), 0)};
  for (std::size_t f = 0; f < study.factors.size(); ++f) {
    if (!study.factors[f].combined) continue;
    const std::size_t before = all.size();
    for (std::size_t l = 1; l < study.factors[f].levels.size(); ++l) {
      for (std::size_t k = 0; k < before; ++k) {
        all.push_back(all[k]);
        all.back()[f] = l;
      }
    }
  }
  return all;
}

double median_of(const RunResult& run, const char* measure) {
  return statistic_of("median", run.measures.at(measure));
}

void run_scans(const Explanation& study, const Levels& best, ModelPool& pool, const Stage& tell,
               ExplainOutcome& outcome) {
  const auto factor = std::find_if(study.factors.begin(), study.factors.end(),
                                   [&](const Factor& f) { return f.id == study.scan_factor; });
  const auto f = static_cast<std::size_t>(factor - study.factors.begin());
  std::vector<std::vector<std::string>> sets;
  std::vector<double> values;
  for (const Scan& scan : study.scans) {
    for (std::size_t l = 0; l < factor->levels.size(); ++l) {
      Levels levels = best;
      levels[f] = l;
      for (const double value : scan.values) {
        std::vector<std::string> set = overrides_of(study, levels);
        set.insert(set.end(), scan.set.begin(), scan.set.end());
        set.push_back(fmt::format("{}={}", scan.key, value));
        sets.push_back(std::move(set));
        values.push_back(value);
      }
    }
  }
  std::vector<ScanPoint> flat(sets.size());
  run_sets(study, sets, pool, tell, [&](std::size_t k, const std::vector<RunResult>& runs) {
    const RunResult& hot = run_of(runs, study.hot_run);
    flat[k] = {.value = values[k],
               .mean_held = judge_repetitions(study, runs).mean_held(),
               .dip_percent = median_of(hot, "absorption_dip_percent"),
               .over_estimate_K = median_of(hot, "estimate_over_limit_K"),
               .over_true_K = median_of(hot, "over_limit_K")};
  });
  auto next = flat.begin();
  for (const Scan& scan : study.scans) {
    auto& lines = outcome.scans.emplace_back();
    for (std::size_t l = 0; l < factor->levels.size(); ++l) {
      lines.emplace_back(next, next + static_cast<std::ptrdiff_t>(scan.values.size()));
      next += static_cast<std::ptrdiff_t>(scan.values.size());
    }
  }
}

double share_of(const std::vector<bool>& holds) {
  return static_cast<double>(std::count(holds.begin(), holds.end(), true)) /
         static_cast<double>(std::max<std::size_t>(1, holds.size()));
}

// A predicate in every repetition by itself, where all statistics are the value.
std::vector<bool> holds_in(const std::string& predicate, const std::vector<RunResult>& results) {
  const MeasureSource all = measures_of(results);
  std::map<std::string, std::vector<double>> known;
  std::vector<bool> holds;
  for (std::size_t s = 0; s < results.front().trajectories.size(); ++s) {
    const auto one = [&](const Term& term) -> std::vector<double> {
      const auto found = known.try_emplace(term.text()).first;
      if (found->second.empty()) found->second = all(term);
      return {found->second.at(s)};
    };
    holds.push_back(evaluate_predicate(predicate, one).holds);
  }
  return holds;
}

struct LabelledLevels {
  Levels levels;
  LabelledSet named;
};

// Confirms the search's best sets, the best of which comes first and is returned, and the
// candidates. The search's first set owes its rank partly to chance in few repetitions.
LabelledLevels confirm_all(const Explanation& study, ModelPool& pool, const Stage& tell,
                           ExplainOutcome& outcome) {
  const std::size_t searched = std::min<std::size_t>(study.best_sets, outcome.together.size());
  const auto all = static_cast<double>(searched + study.candidates.size());
  std::size_t best = 0;
  std::vector<LabelledLevels> sets;
  for (std::size_t k = 0; k < searched; ++k) {
    const Levels& levels = outcome.together[k].levels;
    const Levels defaults(levels.size(), 0);
    sets.push_back({levels, {words_of(study, levels, defaults), overrides_of(study, levels)}});
    outcome.confirmed.push_back(confirm(study, sets[k].named, study.confirm_seeds, pool));
    const double held = outcome.confirmed[k].repetitions().mean_held();
    if (held > outcome.confirmed[best].repetitions().mean_held()) best = k;
    tell(static_cast<double>(outcome.confirmed.size()) / all);
  }
  const auto first = outcome.confirmed.begin();
  std::rotate(first, first + static_cast<std::ptrdiff_t>(best),
              first + static_cast<std::ptrdiff_t>(best) + 1);
  for (const LabelledSet& candidate : study.candidates) {
    outcome.confirmed.push_back(confirm(study, candidate, study.confirm_seeds, pool));
    tell(static_cast<double>(outcome.confirmed.size()) / all);
  }
  // Only the first set's loops are drawn.
  std::for_each(outcome.confirmed.begin() + 1, outcome.confirmed.end(),
                [](ConfirmedSet& one) { one.runs.clear(); });
  return sets[best];
}

}  // namespace

double Repetitions::share(std::size_t statement) const { return share_of(seen[statement]); }

double Repetitions::true_share(std::size_t statement) const { return share_of(truth[statement]); }

double Repetitions::mean_held() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < seen.size(); ++i) sum += share(i);
  return sum;
}

std::size_t Repetitions::with_at_least(std::size_t held) const {
  std::size_t repetitions = 0;
  for (std::size_t s = 0; s < count(); ++s) {
    const auto here =
        std::count_if(seen.begin(), seen.end(), [s](const auto& one) { return one[s]; });
    repetitions += static_cast<std::size_t>(here) >= held ? 1 : 0;
  }
  return repetitions;
}

std::string words_of(const Explanation& study, const std::vector<std::size_t>& levels,
                     const std::vector<std::size_t>& others) {
  std::vector<std::string> changed;
  for (std::size_t f = 0; f < levels.size(); ++f) {
    if (levels[f] == others[f]) continue;
    changed.push_back(study.factors[f].title + ": " + study.factors[f].levels[levels[f]].label);
  }
  return changed.empty() ? "nothing changed" : fmt::format("{}", fmt::join(changed, "; "));
}

std::vector<RunJob> explained_jobs(const Explanation& study, const std::vector<std::string>& set,
                                   int first) {
  std::vector<RunJob> jobs;
  for (const StudyRun& run : study.runs) {
    std::vector<std::string> all = study.set;
    all.insert(all.end(), set.begin(), set.end());
    all.insert(all.end(), run.set.begin(), run.set.end());
    try {
      jobs.push_back({run.id, load_config("", all)});
    } catch (const Error& error) {
      throw Error(fmt::format("{}: run {}: {}", study.file.string(), run.id, error.what()));
    }
    jobs.back().config.run.seed +=
        static_cast<std::uint64_t>(first) + kTreatmentSeeds * jobs.size();
  }
  return jobs;
}

Repetitions judge_repetitions(const Explanation& study, const std::vector<RunResult>& results) {
  Repetitions out;
  for (const Claim& statement : study.statements) {
    try {
      out.seen.push_back(holds_in(statement.holds_if, results));
      out.truth.push_back(statement.in_truth.empty() ? out.seen.back()
                                                     : holds_in(statement.in_truth, results));
    } catch (const Error& error) {
      throw error.at(study.file.string());
    }
  }
  return out;
}

ExplainOutcome explain(const Explanation& study, bool quick, bool use_cache,
                       const Progress& progress) {
  ModelPool pool(use_cache);
  ExplainOutcome outcome;
  outcome.study = study;
  Explanation& used = outcome.study;
  if (quick) {
    used.seeds = 1;
    used.confirm_seeds = std::min(used.confirm_seeds, 4);
    used.scans.clear();
  }
  const auto stage = [&progress](const char* name) {
    return [&progress, name](double fraction) {
      if (progress) progress(name, fraction);
    };
  };
  const Levels defaults(used.factors.size(), 0);
  outcome.alone = judge_points(used, neighbours(used, defaults), pool, stage("one thing changed"));
  outcome.together = judge_points(used, combinations(used), pool, stage("all combinations"));
  std::stable_sort(outcome.together.begin(), outcome.together.end(),
                   [](const ExplainedPoint& a, const ExplainedPoint& b) {
                     const double more = a.repetitions.mean_held() - b.repetitions.mean_held();
                     return more != 0.0 ? more > 0.0 : a.changed < b.changed;
                   });
  const LabelledLevels best = confirm_all(used, pool, stage("confirmed with other seeds"), outcome);
  outcome.around =
      judge_points(used, neighbours(used, best.levels), pool, stage("around the best set"));
  run_scans(used, best.levels, pool, stage("sensitivity"), outcome);
  stage("remedies")(0.0);
  outcome.remedies = try_remedies(used, best.named.set, outcome.confirmed.front(), pool);
  return outcome;
}

}  // namespace photocoag
