#include "photocoag/console/messages.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "photocoag/core/build_info.hpp"
#include "photocoag/safety/power_check.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kColumns[] = {"cycle",
                                         "time_s",
                                         "power_W",
                                         "power_command_W",
                                         "readback_W",
                                         "wanted_power_W",
                                         "power_reference_W",
                                         "volume_measured_K",
                                         "volume_predicted_K",
                                         "volume_estimate_K",
                                         "peak_estimate_K",
                                         "peak_sigma_K",
                                         "peak_true_K",
                                         "absorption_estimate",
                                         "absorption_sigma",
                                         "wake_late_ns",
                                         "compute_ns",
                                         "slack_ns",
                                         "overrun",
                                         "limit_active",
                                         "solver_status",
                                         "solver_iterations",
                                         "safety_state",
                                         "safety_reason",
                                         "sample_verdict"};

// Enough digits for a screen; the log has all.
constexpr const char* kReal = "{:.7g}";

Json item(std::string_view name, bool good, std::string found, std::string accepted) {
  return {{"name", name},
          {"good", good},
          {"found", std::move(found)},
          {"accepted", std::move(accepted)}};
}

}  // namespace

std::span<const CycleField* const> live_columns() {
  static const auto columns = [] {
    std::array<const CycleField*, std::size(kColumns)> list{};
    for (std::size_t i = 0; i < list.size(); ++i) list[i] = field_named(kColumns[i]);
    return list;
  }();
  return columns;
}

std::string hello_message(int client) {
  Json columns = Json::array();
  for (const CycleField* field : live_columns()) {
    columns.push_back({{"name", field->name}, {"unit", field->unit}});
  }
  return Json{{"type", "hello"},
              {"protocol", kConsoleProtocol},
              {"program", fmt::format("photocoag {}", version())},
              {"notice", kResearchNotice},
              {"client", client},
              {"columns", columns}}
      .dump();
}

std::string json_number(double value) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(kReal), value) : "null";
}

void append_row(std::string& to, const LogRecord& record) {
  char separator = '[';
  for (const CycleField* field : live_columns()) {
    to += std::exchange(separator, ',');
    const std::uint64_t bits = field->get(record);
    if (field->type == FieldType::kWord) {
      fmt::format_to(std::back_inserter(to), "\"{}\"", field->word(bits));
    } else if (field->type == FieldType::kReal) {
      to += json_number(std::bit_cast<double>(bits));
    } else if (static_cast<std::int64_t>(bits) == LogRecord::kNoTime) {
      to += "null";
    } else {
      fmt::format_to(std::back_inserter(to), "{}", static_cast<std::int64_t>(bits));
    }
  }
  to += ']';
}

std::string self_test_message(const SelfTestReport& report, const SafetyLimits& limits) {
  const SelfTestBounds bounds = self_test_bounds(limits, report.samples);
  const auto yes = [](bool good, const char* is, const char* is_not) { return good ? is : is_not; };
  Json items = Json::array();
  items.push_back(item("Samples at 0 W", report.samples >= SelfTestBounds::kSamples,
                       fmt::format("{}", report.samples),
                       fmt::format("at least {}", SelfTestBounds::kSamples)));
  items.push_back(item("Mean at 0 W", std::abs(report.mean) <= bounds.mean,
                       fmt::format("{:+.3f} K", report.mean),
                       fmt::format("within ±{:.3f} K", bounds.mean)));
  items.push_back(item("Noise at 0 W",
                       report.sigma >= bounds.sigma_low && report.sigma <= bounds.sigma_high,
                       fmt::format("{:.3f} K", report.sigma),
                       fmt::format("{:.3f} to {:.3f} K", bounds.sigma_low, bounds.sigma_high)));
  items.push_back(item("Power read back at 0 W", std::abs(report.power_at_zero) <= kReadbackFloor,
                       fmt::format("{:.2f} mW", report.power_at_zero * 1e3),
                       fmt::format("at most {:.2f} mW", kReadbackFloor * 1e3)));
  items.push_back(item("Interlock, shutter, foot switch", report.switches_ready(),
                       fmt::format("{}, {}, {}", yes(report.interlock_closed, "closed", "open"),
                                   yes(report.shutter_open, "open", "closed"),
                                   yes(report.foot_switch, "pressed", "released")),
                       "closed, open, pressed"));
  items.push_back(item("Watchdog", report.watchdog_tripped,
                       yes(report.watchdog_tripped, "trips", "did not trip"),
                       "0 W without a fresh command"));
  items.push_back(item("Model fits tissue and period", report.model_matches,
                       yes(report.model_matches, "yes", "no"), "yes"));
  items.push_back(item("Solver on a known problem", report.solver_exact,
                       yes(report.solver_exact, "exact", "wrong"), "to 1e-9"));
  items.push_back(item("Log", report.log_has_room,
                       yes(report.log_has_room, "has room", "cannot be written"), "writable"));
  bool passed = true;
  for (const Json& one : items) passed = passed && one["good"].get<bool>();
  return Json{{"type", "self_test"}, {"passed", passed}, {"items", items}}.dump();
}

std::optional<std::string> command_of(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || json.size() != 1 || !json.contains("command")) return std::nullopt;
  if (!json["command"].is_string()) return std::nullopt;
  return json["command"].get<std::string>();
}

std::string answer_message(std::string_view command, std::string_view refusal) {
  return Json{{"type", "answer"}, {"command", command}, {"done", refusal.empty()}, {"why", refusal}}
      .dump();
}

}  // namespace photocoag
