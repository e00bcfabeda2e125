#include "photocoag/study/reproduce.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/loop/controller.hpp"
#include "photocoag/run/claimed_folder.hpp"
#include "photocoag/study/timing.hpp"

namespace photocoag {

std::string_view name_of(ClaimVerdict verdict) noexcept {
  constexpr std::string_view names[] = {"holds", "differs", "undecided", "cannot be judged here"};
  return names[static_cast<std::size_t>(verdict)];
}

bool JudgedClaim::as_expected() const noexcept {
  if (claim.expected.empty() || claim.expected == name_of(verdict)) return true;
  return other_seeds && (claim.expected == name_of(ClaimVerdict::kUndecided) ||
                         verdict == ClaimVerdict::kUndecided);
}

namespace {

ClaimVerdict judge(const Study& study, const char* key, const std::string& predicate,
                   const std::vector<RunResult>& results, std::vector<TermValue>& terms) {
  constexpr int kResamples = 1000;
  constexpr double kDoubt = 0.025;
  try {
    PredicateResult result = evaluate_predicate(predicate, measures_of(results), kResamples);
    terms = std::move(result.terms);
    if (result.support >= 1.0 - kDoubt) return ClaimVerdict::kHolds;
    return result.support <= kDoubt ? ClaimVerdict::kDiffers : ClaimVerdict::kUndecided;
  } catch (const Error& error) {
    ErrorParts parts = error.parts();
    parts.where = study.file.string();
    parts.key = key;
    if (parts.accepted.empty()) parts.accepted = "in: " + predicate;
    throw Error(std::move(parts));
  }
}

/// Whether a claim says that it cannot be judged without this run.
bool some_claim_needs(const Study& study, const std::string& run) {
  return std::any_of(study.claims.begin(), study.claims.end(),
                     [&run](const Claim& claim) { return claim.needs == run; });
}

}  // namespace

JudgedClaim judge_claim(const Study& study, const Claim& claim,
                        const std::vector<RunResult>& results) {
  JudgedClaim judged;
  judged.claim = claim;
  if (claim.holds_if.empty()) return judged;
  const auto is_needed = [&claim](const RunResult& run) { return run.id == claim.needs; };
  if (!claim.needs.empty() && std::none_of(results.begin(), results.end(), is_needed)) {
    return judged;
  }
  judged.verdict = judge(study, "claim.holds_if", claim.holds_if, results, judged.terms);
  if (!claim.in_truth.empty()) {
    judged.in_truth = judge(study, "claim.in_truth", claim.in_truth, results, judged.truth_terms);
  }
  return judged;
}

StudyOutcome run_study(const Study& study, const std::vector<std::string>& extra, int seeds,
                       ModelPool& pool, const Progress& progress) {
  StudyOutcome outcome{
      .study = study, .seeds = seeds, .results = {}, .claims = {}, .variations = {}};
  if (study.kind == StudyKind::kComputationTimes) {
    outcome.results = time_solvers(study, seeds, pool);
  } else {
    std::vector<RunJob> jobs;
    for (const StudyRun& run : study.runs) {
      std::vector<std::string> set = study.overrides(run);
      set.insert(set.end(), extra.begin(), extra.end());
      const bool may_be_missing = !extra.empty() && some_claim_needs(study, run.id);
      try {
        const Config config = load_config(study.base, set);
        if (may_be_missing) {
          static_cast<void>(
              Controller(pool.get(config)->reduced, config.control, config.estimator));
        }
        jobs.push_back({run.id, config});
      } catch (const Error& error) {
        if (may_be_missing) continue;
        throw Error(fmt::format("{}: run {}: {}", study.file.string(), run.id, error.what()));
      }
    }
    outcome.results = run_all(jobs, seeds, pool, progress);
  }
  for (const Claim& claim : study.claims) {
    outcome.claims.push_back(judge_claim(study, claim, outcome.results));
  }
  return outcome;
}

std::vector<StudyOutcome> reproduce(const ReproduceOptions& options, const Progress& progress) {
  check_run_folder(options.out);
  const Plan plan = load_plan(options.studies / "plan.toml");
  std::vector<Study> studies;
  for (const std::string& id : plan.studies) {
    studies.push_back(load_study(options.studies / (id + ".toml")));
  }
  const std::vector<Variation> variations =
      options.quick ? std::vector<Variation>{} : plan.variations;
  const auto steps = static_cast<double>(studies.size() * (1 + variations.size()));
  double step = 0.0;
  ModelPool pool(options.use_cache);
  std::vector<StudyOutcome> outcomes;
  const auto tell = [&](const std::string& label, double within) {
    if (progress) progress(label, (step + within) / steps);
  };
  for (const Study& study : studies) {
    tell(study.id, 0.0);
    const bool loops = study.kind == StudyKind::kClosedLoop;
    const int seeds = loops && options.seeds > 0 ? options.seeds : plan.seeds;
    outcomes.push_back(run_study(study, {}, seeds, pool, [&](std::string_view, double fraction) {
      tell(study.id, fraction);
    }));
    for (JudgedClaim& claim : outcomes.back().claims) claim.other_seeds = seeds != plan.seeds;
    step += 1.0;
    if (study.kind == StudyKind::kComputationTimes) {
      step += static_cast<double>(variations.size());
      continue;  // the machine's, not the tissue's
    }
    for (const Variation& variation : variations) {
      const std::string label = study.id + ", " + variation.id;
      const StudyOutcome varied =
          run_study(study, variation.set, plan.variation_seeds, pool,
                    [&](std::string_view, double fraction) { tell(label, fraction); });
      VariedStudy& row = outcomes.back().variations.emplace_back();
      row.variation = variation;
      for (const JudgedClaim& claim : varied.claims) row.verdicts.push_back(claim.verdict);
      step += 1.0;
    }
  }
  std::vector<StudyFile> files;
  std::vector<std::vector<StudyDrawing>> drawings;
  for (const StudyOutcome& outcome : outcomes) drawings.push_back(draw_study(outcome, files));
  files.push_back({"claims.json", claims_json(outcomes, options.quick)});
  files.push_back({"index.html", reproduce_page(outcomes, drawings, options.quick)});
  std::filesystem::create_directories(options.out);
  for (const StudyFile& file : files) write_file((options.out / file.name).string(), file.content);
  return outcomes;
}

std::string claims_json(const std::vector<StudyOutcome>& outcomes, bool quick) {
  using Json = nlohmann::ordered_json;
  Json claims = Json::array();
  for (const StudyOutcome& outcome : outcomes) {
    for (std::size_t i = 0; i < outcome.claims.size(); ++i) {
      const JudgedClaim& claim = outcome.claims[i];
      Json terms = Json::array();
      for (const TermValue& term : claim.terms) {
        const auto finite = [](double v) { return std::isfinite(v) ? Json(v) : Json(); };
        terms.push_back({{"term", term.term.text()},
                         {"value", finite(term.value)},
                         {"interval_95", {finite(term.low), finite(term.high)}}});
      }
      Json varied = Json::object();
      for (const VariedStudy& variation : outcome.variations) {
        varied[variation.variation.id] = name_of(variation.verdicts[i]);
      }
      claims.push_back({{"study", outcome.study.id},
                        {"claim", claim.claim.text},
                        {"verdict", name_of(claim.verdict)},
                        {"in_truth", claim.in_truth ? Json(name_of(*claim.in_truth)) : Json()},
                        {"whose", claim.claim.ours ? "ours" : "paper"},
                        {"expected", claim.claim.expected},
                        {"holds_if", claim.claim.holds_if},
                        {"measured", terms},
                        {"seeds", outcome.seeds},
                        {"why", claim.verdict == ClaimVerdict::kDiffers ? claim.claim.differs
                                                                        : claim.claim.cannot_judge},
                        {"sensitivity", varied}});
    }
  }
  const Json json = {
      {"notice", kResearchNotice}, {"version", version()}, {"quick", quick}, {"claims", claims}};
  return json.dump(2) + "\n";
}

}  // namespace photocoag
