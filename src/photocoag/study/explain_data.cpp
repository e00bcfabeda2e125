// The data of `explain`, beside its page.
#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "photocoag/core/build_info.hpp"
#include "photocoag/study/explain.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

void add_sets(const Explanation& study, const char* search,
              const std::vector<ExplainedPoint>& points, std::string& csv) {
  for (const ExplainedPoint& point : points) {
    csv += search;
    for (std::size_t f = 0; f < study.factors.size(); ++f) {
      csv += ",\"" + study.factors[f].levels[point.levels[f]].label + "\"";
    }
    csv += fmt::format(",{}", point.repetitions.mean_held());
    for (std::size_t i = 0; i < study.statements.size(); ++i) {
      csv += fmt::format(",{},{}", point.repetitions.share(i), point.repetitions.true_share(i));
    }
    csv += '\n';
  }
}

Json by_reading(const ConfirmedSet& one, const std::function<Json(const ReadResult&)>& value) {
  Json all;
  constexpr const char* kNames[kReadings] = {"estimate", "prediction", "afterwards"};
  for (std::size_t r = 0; r < kReadings; ++r) all[kNames[r]] = value(one.readings[r]);
  return all;
}

}  // namespace

std::string sets_csv(const ExplainOutcome& outcome) {
  std::string csv = "search";
  for (const Factor& factor : outcome.study.factors) csv += "," + factor.id;
  csv += ",mean_held";
  for (std::size_t i = 1; i <= outcome.study.statements.size(); ++i) {
    csv += fmt::format(",seen_{},true_{}", i, i);
  }
  csv += '\n';
  add_sets(outcome.study, "alone", outcome.alone, csv);
  add_sets(outcome.study, "together", outcome.together, csv);
  add_sets(outcome.study, "around", outcome.around, csv);
  return csv;
}

std::string explanation_json(const ExplainOutcome& outcome) {
  Json sets = Json::array();
  const std::size_t all = outcome.study.statements.size();
  for (const ConfirmedSet& one : outcome.confirmed) {
    Json statements = Json::array();
    for (std::size_t i = 0; i < all; ++i) {
      statements.push_back({{"statement", outcome.study.statements[i].text},
                            {"share_seen", one.repetitions().share(i)},
                            {"share_true", one.repetitions().true_share(i)}});
    }
    sets.push_back(
        {{"set", one.label},
         {"repetitions", one.repetitions().count()},
         {"mean_held",
          by_reading(one, [](const ReadResult& r) { return r.repetitions.mean_held(); })},
         {"with_all", one.repetitions().with_at_least(all)},
         {"with_all_but_one", one.repetitions().with_at_least(all - 1)},
         {"over_K", by_reading(one, [](const ReadResult& r) { return r.over_K; })},
         {"over_true_K", one.over_true_K},
         {"true_lag_periods", one.true_lag},
         {"found_lags_periods", one.found_lags},
         {"statements", statements}});
  }
  Json remedies = Json::array();
  for (const Remedy& one : outcome.remedies) {
    remedies.push_back({{"remedy", one.label},
                        {"over_limit", one.over},
                        {"peak_true_max_K", one.true_K},
                        {"peak_estimate_max_K", one.estimate_K},
                        {"held_mean_error_K", one.held_K},
                        {"time_to_95_ms", one.time_to_95_ms}});
  }
  return Json{{"notice", kResearchNotice},
              {"version", version()},
              {"sets_searched", outcome.together.size()},
              {"confirmed", sets},
              {"remedies", remedies}}
             .dump(2) +
         "\n";
}

}  // namespace photocoag
