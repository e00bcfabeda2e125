#include "photocoag/session/session_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <utility>

#include "photocoag/config/table_reader.hpp"
#include "photocoag/config/usage.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/linear_algebra.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/population/eye_draws.hpp"
#include "photocoag/run/device_config.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kMostSpots = 1000;
constexpr PriorTables kShared{"shared", "shared_correlation", false};
constexpr PriorTables kVaried{"varied", "varied_correlation", false};

// What reference, duration and goal of a spot amount to.
std::vector<std::string> goal_of(const TableReader& spot) {
  std::vector<std::string> set;
  const auto add = [&](std::string_view key, std::string_view target) {
    if (const Value* value = spot.find(key)) {
      spot.number(key, 0.0, 1e6);
      set.push_back(fmt::format("{}={}", target, value->text));
    }
  };
  add("reference_K", "control.peak_reference_K");
  add("duration_ms", "run.duration_ms");
  if (spot.find("hold_ms") != nullptr && spot.find("dose") != nullptr) {
    spot.refuse("dose", "no dose beside hold_ms");
  }
  if (spot.find("hold_ms") != nullptr) set.emplace_back("run.goal=hold");
  if (spot.find("dose") != nullptr) set.emplace_back("run.goal=dose");
  add("hold_ms", "run.hold_ms");
  add("dose", "run.dose");
  return set;
}

constexpr double kFarthest_um = 1e5;

void add_grid(const Value& table, std::vector<SpotPlan>& spots) {
  const TableReader grid(
      table, "grid",
      {"rows", "columns", "spacing_um", "reference_K", "duration_ms", "hold_ms", "dose"});
  for (const char* key : {"rows", "columns", "spacing_um"}) grid.required(key);
  const std::uint64_t rows = *grid.count("rows", 1, 26);
  const std::uint64_t columns = *grid.count("columns", 1, 99);
  const double spacing = *grid.number("spacing_um", 1.0, kFarthest_um) * 1e-6;
  const std::vector<std::string> set = goal_of(grid);
  for (std::uint64_t row = 0; row < rows; ++row) {
    for (std::uint64_t column = 0; column < columns; ++column) {
      spots.push_back(
          {.name = fmt::format("{}{}", static_cast<char>('A' + row), column + 1),
           .x = spacing * (static_cast<double>(column) - 0.5 * static_cast<double>(columns - 1)),
           .y = spacing * (0.5 * static_cast<double>(rows - 1) - static_cast<double>(row)),
           .set = set});
    }
  }
}

void add_spot(const TableReader& spot, std::vector<SpotPlan>& spots) {
  spot.only({"name", "x_um", "y_um", "reference_K", "duration_ms", "hold_ms", "dose", "set"});
  constexpr std::string_view kAllowed =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  const std::string text = spot.required_text("name");
  if (text.empty() || text.size() > 40 || text.find_first_not_of(kAllowed) != std::string::npos) {
    spot.refuse("name", "1 to 40 letters, digits, - and _");
  }
  SpotPlan plan{.name = text,
                .x = spot.number("x_um", -kFarthest_um, kFarthest_um).value_or(0.0) * 1e-6,
                .y = spot.number("y_um", -kFarthest_um, kFarthest_um).value_or(0.0) * 1e-6,
                .set = goal_of(spot)};
  for (std::string& one : spot.texts("set")) plan.set.push_back(std::move(one));
  if (std::any_of(spots.begin(), spots.end(),
                  [&](const SpotPlan& other) { return other.name == text; })) {
    spot.refuse("name", "a name that no other spot has");
  }
  spots.push_back(std::move(plan));
}

// Refuses what a session cannot set.
EyeDraws draws_of(const Prior& prior, const PriorTables& tables, Config config,
                  std::uint64_t seed) {
  for (const RandomQuantity& q : prior.quantities) {
    if (eye_number(config, q.key)) continue;
    throw Error(ErrorParts{.key = fmt::format("{}.key", tables.quantities),
                           .found = q.key,
                           .accepted = "a number of the eye, e.g. plant.absorption_factor, "
                                       "plant.tissue.transmission, plant.sample_gain"});
  }
  return {seed, prior.quantities, *cholesky(correlation_matrix(prior, tables))};
}

void set_eye(const EyeDraws& draws, std::uint64_t which, Config& config) {
  if (draws.inputs.empty()) return;
  InputSetter(draws, config).set(draw_inputs(draws, which));
  config.plant.tissue_differs = !(config.plant.tissue == config.tissue);
}

constexpr std::uint64_t kSharedSeed = 0x5e55105eed0000ULL;  // apart from the spots' draws

std::vector<Config> drawn(const Session& session, std::vector<Config> configs, std::uint64_t seed) {
  if (configs.empty()) return configs;
  const EyeDraws shared = draws_of(session.shared, kShared, configs.front(), seed ^ kSharedSeed);
  const EyeDraws varied = draws_of(session.varied, kVaried, configs.front(), seed);
  for (std::size_t k = 0; k < configs.size(); ++k) {
    set_eye(shared, 0, configs[k]);
    set_eye(varied, k, configs[k]);
    configs[k].run.seed = seed * kMostSpots + k;
    configs[k].validate();
  }
  return configs;
}

void require_learnable(const Session& session) {
  for (const Config& config : session.configs) {
    const bool posterior = config.uses_prior();
    if (!posterior && !wants_margin(config)) continue;
    throw Error(ErrorParts{
        .where = session.file,
        .key = "session.learn",
        .problem = posterior ? "what is believed comes from [[prior]]"
                             : "the margin is searched for the configured prior",
        .found = "true",
        .accepted = "estimator.kind \"ekf\" or \"mhe\" without a margin, or learn = false"});
  }
}

std::vector<Config> read_configs(Session& session) {
  std::vector<Config> configs;
  const Use use = use_of(session.place);
  for (const SpotPlan& spot : session.spots) {
    std::vector<std::string> set = session.set;
    set.insert(set.end(), spot.set.begin(), spot.set.end());
    std::vector<UnusedKey> unused;
    try {
      Config config = load_config(session.config_file, set, use, unused);
      configs.push_back(for_device(std::move(config), session.place));
    } catch (const Error& error) {
      ErrorParts parts = error.parts();
      parts.where = fmt::format("{}: spot {}: {}", session.file, spot.name, parts.where);
      throw Error(std::move(parts));
    }
    for (const UnusedKey& one : unused) {
      if (std::find(session.remarks.begin(), session.remarks.end(), one.key) ==
          session.remarks.end()) {
        session.remarks.push_back(one.key);
      }
    }
  }
  return configs;
}

void read_session_table(const Value* table, Session& session) {
  const Value none;
  const TableReader keys(table != nullptr ? *table : none, "session",
                         {"title", "config", "set", "device", "pacing", "pause_ms", "seed", "learn",
                          "learn_floor", "after_stop"});
  session.title = keys.text("title", std::filesystem::path(session.file).stem().string());
  if (const std::string config = keys.text("config"); !config.empty()) {
    session.config_file =
        (std::filesystem::path(session.file).parent_path() / config).lexically_normal().string();
  }
  session.set = keys.texts("set");
  session.device = keys.text("device");
  if (!session.device.empty()) session.place = parse_device(session.device);
  if (keys.word("pacing", {"clock", "virtual"}, "clock") == "virtual") {
    keys.require(session.place.here(), "pacing", "\"clock\" on a device");
    session.place = virtual_eye();
  }
  session.pause = keys.number("pause_ms", 0.0, 3.6e6).value_or(0.0) * 1e-3;
  session.seed = keys.count("seed", 0, 1'000'000'000'000).value_or(1);
  session.learn = keys.flag("learn", false);
  session.learn_floor = keys.number("learn_floor", 0.005, 2.0).value_or(session.learn_floor);
  session.ends_with_a_stop = keys.word("after_stop", {"end", "continue"}, "end") == "end";
}

void read_limits(const Value* table, SessionLimits& limits) {
  if (table == nullptr) return;
  const TableReader keys(*table, "limits", {"energy_mJ", "spots", "time_s"});
  if (const auto energy = keys.number("energy_mJ", 0.001, 1e6)) limits.energy = *energy * 1e-3;
  if (const auto time = keys.number("time_s", 0.001, 1e6)) limits.time = *time;
  if (const auto spots = keys.count("spots", 1, 1'000'000)) limits.spots = *spots;
}

void read_all(const Value& root, Session& session) {
  const TableReader keys(root, "",
                         {"session", "limits", "grid", "spot", "shared", "shared_correlation",
                          "varied", "varied_correlation"});
  read_session_table(keys.find("session"), session);
  read_limits(keys.find("limits"), session.limits);
  if (const Value* grid = keys.find("grid")) add_grid(*grid, session.spots);
  for (const TableReader& spot : keys.tables("spot")) add_spot(spot, session.spots);
  if (session.spots.empty() || session.spots.size() > kMostSpots) {
    throw Error(ErrorParts{.where = session.file,
                           .key = "spot",
                           .found = fmt::format("{} spots", session.spots.size()),
                           .accepted = fmt::format("1 to {}, as [grid] or [[spot]]", kMostSpots)});
  }
  session.shared = read_prior(root, kShared);
  session.varied = read_prior(root, kVaried);
  if (!session.place.here() && !session.place.own_process &&
      !(session.shared.quantities.empty() && session.varied.quantities.empty())) {
    throw Error(ErrorParts{.where = session.file,
                           .key = "varied",
                           .problem = "the device has an eye of its own",
                           .found = session.device,
                           .accepted = "[[shared]] and [[varied]] with a simulated eye that the "
                                       "session starts"});
  }
}

}  // namespace

std::string Session::identity() const {
  std::string all = text + device + std::string(source_hash());
  for (const Config& config : configs) all += to_toml(config);
  return sha256_hex(all);
}

std::size_t Session::find(const std::string& name, const std::string& option) const {
  for (std::size_t k = 0; k < spots.size(); ++k) {
    if (spots[k].name == name) return k;
  }
  throw Error(
      ErrorParts{.where = option,
                 .problem = "there is no such spot",
                 .found = name,
                 .accepted = fmt::format("one of {} … {}", spots.front().name, spots.back().name)});
}

Session load_session(const std::string& file) {
  const Value root = read_toml_file(file);
  Session session;
  session.file = file;
  session.text = read_file(file, 1'000'000);
  read_all(root, session);
  session.configs = read_configs(session);
  try {
    session.configs = drawn(session, std::move(session.configs), session.seed);
  } catch (const Error& error) {
    throw error.at(file);
  }
  if (session.learn) require_learnable(session);
  return session;
}

std::vector<Config> session_configs(const Session& session, std::uint64_t seed) {
  return drawn(session, session.configs, seed);
}

double worst_energy(const Config& config) noexcept {
  const double longest = static_cast<double>(config.cycles() + 1) * config.control.period;
  const double most = config.control.power_max * longest;
  return config.safety.supervised ? std::min(most, config.safety.energy_max) : most;
}

}  // namespace photocoag
