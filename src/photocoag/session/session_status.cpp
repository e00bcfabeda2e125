#include "photocoag/session/session_status.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json limit(const char* name, double used, double most, const char* unit) {
  return {{"name", name}, {"used", number(used)}, {"most", number(most)}, {"unit", unit}};
}

Json limits_of(const SessionLimits& limits, const SessionState& state) {
  const bool some = limits.spots < std::numeric_limits<std::size_t>::max();
  return Json::array(
      {limit("Energy counted", state.energy * 1e3, limits.energy * 1e3, "mJ"),
       limit("Spots begun", static_cast<double>(state.attempts.size()),
             some ? static_cast<double>(limits.spots) : std::numeric_limits<double>::infinity(),
             ""),
       limit("Time", std::numeric_limits<double>::quiet_NaN(), limits.time, "s")});
}

// The place of a spot's last attempt among all, from 1 on: its run folder for the console.
std::size_t run_of(const SpotHistory& spot, const SessionState& state) {
  const AttemptOutcome& last = spot.attempts.back();
  const auto found =
      std::find_if(state.attempts.begin(), state.attempts.end(), [&](const AttemptOutcome& one) {
        return one.spot == last.spot && one.attempt == last.attempt;
      });
  return static_cast<std::size_t>(found - state.attempts.begin()) + 1;
}

Json spot_of(const SpotPlan& plan, const Config& config, const SpotHistory& spot,
             const SessionState& state) {
  const SpotEnding ending = spot.ending();
  Json json = {{"name", plan.name},
               {"x_um", plan.x * 1e6},
               {"y_um", plan.y * 1e6},
               {"reference_K", config.control.peak_reference},
               {"duration_ms", config.run.duration * 1e3},
               {"most_energy_mJ", worst_energy(config) * 1e3},
               {"ending", word_of(ending)},
               {"words", words_of(ending)},
               {"wanted", spot.wanted},
               {"attempts", spot.attempts.size()}};
  if (spot.attempts.empty()) return json;
  const AttemptOutcome& last = spot.attempts.back();
  const bool truth = std::isfinite(last.peak_true_max_K);
  json["run"] = run_of(spot, state);
  json["why"] = last.why;
  json["energy_mJ"] = number(last.energy_mJ);
  json["peak_K"] = number(truth ? last.peak_true_max_K : last.peak_estimate_max_K);
  json["peak_is_true"] = truth;
  json["absorption"] = number(last.absorption);
  return json;
}

}  // namespace

std::string_view word_of(SessionPhase phase) noexcept {
  constexpr std::array<std::string_view, 7> kWords = {"preparing", "before", "starting", "treating",
                                                      "writing",   "after",  "ended"};
  return kWords[static_cast<std::size_t>(phase)];
}

SessionState state_of(const SessionJournal& journal) {
  return {.spots = journal.spots(),
          .attempts = journal.attempts(),
          .energy = journal.energy(),
          .begun = journal.begun()};
}

std::string session_message(const Session& session, const SessionState& state, SessionPhase phase,
                            const std::string& spot, const std::string& why,
                            const std::filesystem::path& folder) {
  Json spots = Json::array();
  for (std::size_t k = 0; k < session.spots.size() && k < state.spots.size(); ++k) {
    spots.push_back(spot_of(session.spots[k], session.configs[k], state.spots[k], state));
  }
  const Json json = {{"type", "session"},
                     {"title", session.title},
                     {"folder", std::filesystem::absolute(folder).string()},
                     {"phase", word_of(phase)},
                     {"spot", spot},
                     {"why", why},
                     {"pause_ms", session.pause * 1e3},
                     {"begun_unix_s", state.begun},
                     {"limits", limits_of(session.limits, state)},
                     {"spots", std::move(spots)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace photocoag
