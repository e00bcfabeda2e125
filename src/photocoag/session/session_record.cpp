#include "photocoag/session/session_record.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>

#include "photocoag/core/build_info.hpp"
#include "photocoag/population/statistics.hpp"
#include "photocoag/run_files/table.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json summary_of(const Session& session, const SessionResult& result) {
  const SessionTotals totals = totals_of(result);
  return {{"notice", std::string(kResearchNotice)},
          {"title", session.title},
          {"spots", totals.spots},
          {"treated_spots", totals.treated},
          {"over_limit_spots", totals.over_limit},
          {"stopped_spots", totals.stopped},
          {"may_have_emitted_spots", totals.uncertain},
          {"attempts", totals.attempts},
          {"energy_mJ", totals.energy_mJ},
          {"absorption_mean", number(totals.absorption_mean)},
          {"absorption_std", number(totals.absorption_deviation)},
          {"end", word_of(result.end)},
          {"why", result.why.empty() ? Json() : Json(result.why)},
          {"continued", result.continued},
          {"seed", session.seed},
          {"identity", session.identity()},
          {"version", version()}};
}

std::string text_of(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string_view word_of(SessionEnd end) noexcept {
  constexpr std::array<std::string_view, 7> kWords = {
      "complete", "interrupted", "operator", "stopped", "device-fault", "limit", "failed"};
  return kWords[static_cast<std::size_t>(end)];
}

SessionTotals totals_of(const SessionResult& result) {
  SessionTotals totals{.spots = result.spots.size(), .attempts = result.attempts.size()};
  totals.energy_mJ = result.energy * 1e3;
  std::vector<double> absorption;
  for (const SpotHistory& spot : result.spots) {
    const SpotEnding ending = spot.ending();
    totals.treated += is_complete(ending) ? 1 : 0;
    totals.over_limit += ending == SpotEnding::kOverLimit ? 1 : 0;
    totals.stopped += ending == SpotEnding::kStopped ? 1 : 0;
    totals.uncertain += ending == SpotEnding::kMayHaveEmitted ? 1 : 0;
    if (is_complete(ending)) absorption.push_back(spot.attempts.back().absorption);
  }
  if (!absorption.empty()) {
    std::tie(totals.absorption_mean, totals.absorption_deviation) = mean_and_deviation(absorption);
  }
  return totals;
}

std::string session_json(const Session& session, const SessionResult& result) {
  Json json = summary_of(session, result);
  const SessionLimits& limits = session.limits;
  json["device"] = session.device.empty() ? Json() : Json(session.device);
  json["learn"] = session.learn;
  json["limits"] = {
      {"energy_mJ", number(limits.energy * 1e3)},
      {"time_s", number(limits.time)},
      {"spots",
       limits.spots < std::numeric_limits<std::size_t>::max() ? Json(limits.spots) : Json()}};
  json["plan"] = Json::array();
  for (std::size_t k = 0; k < session.spots.size(); ++k) {
    const SpotPlan& plan = session.spots[k];
    json["plan"].push_back({{"spot", plan.name},
                            {"x_um", plan.x * 1e6},
                            {"y_um", plan.y * 1e6},
                            {"reference_K", session.configs[k].control.peak_reference},
                            {"ending", word_of(result.spots[k].ending())}});
  }
  json["attempt"] = Json::array();
  for (const AttemptOutcome& attempt : result.attempts) json["attempt"].push_back(to_json(attempt));
  return text_of(json);
}

std::string session_summary_json(const Session& session, const SessionResult& result) {
  return text_of(summary_of(session, result));
}

void write_session_table(const std::filesystem::path& file, const Session& session,
                         const SessionResult& result) {
  DataTable table;
  table.rows_are = "attempts";
  table.about = {{"notice", std::string(kResearchNotice)},
                 {"program", fmt::format("photocoag {}", version())},
                 {"source_hash", std::string(source_hash())},
                 {"title", session.title},
                 {"identity", session.identity()}};
  std::vector<std::string> names, endings, folders;
  std::vector<std::int64_t> attempts;
  std::vector<double> x, y, reference;
  for (const AttemptOutcome& attempt : result.attempts) {
    const std::size_t k = session.find(attempt.spot, session.file);
    names.push_back(attempt.spot);
    attempts.push_back(attempt.attempt);
    endings.emplace_back(word_of(attempt.ending));
    folders.push_back(attempt.folder);
    x.push_back(session.spots[k].x * 1e6);
    y.push_back(session.spots[k].y * 1e6);
    reference.push_back(session.configs[k].control.peak_reference);
  }
  table.columns = {
      {"spot", "-", names},           {"attempt", "1", attempts}, {"ending", "-", endings},
      {"folder", "-", folders},       {"x_um", "um", x},          {"y_um", "um", y},
      {"reference_K", "K", reference}};
  for (const OutcomeNumber& one : outcome_numbers()) {
    std::vector<double> values;
    for (const AttemptOutcome& attempt : result.attempts) values.push_back(attempt.*one.value);
    table.columns.push_back({std::string(one.name), std::string(one.unit), values});
  }
  write_hdf5(file.string(), table);
}

}  // namespace photocoag
