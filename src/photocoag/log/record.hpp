// Role: online; one cycle as it goes into the crash-safe log: plain data, eight bytes a field, with
// a table of names and units that is written in front of every file. Used by log, run.
// Source: docs/realtime.md. Units: SI, in the names of the table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <type_traits>

namespace photocoag {

/// Numbers that do not exist are NaN, durations that do not exist kNoTime. Enumerations are stored
/// as their numbers.
struct LogRecord {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  static constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::min();

  std::int64_t record = 0;  // 0, 1, … as the loop produced them; a gap: dropped
  std::int64_t cycle = 0;
  double time = 0.0;
  double power = 0.0;
  double volume_true = kNone;
  double peak_true = kNone;
  double measured = kNone;
  double volume_estimate = 0.0;
  double peak_estimate = 0.0;
  double peak_sigma = 0.0;
  double absorption = 0.0;
  double absorption_sigma = 0.0;
  double choroid = 1.0;
  double choroid_sigma = 0.0;
  std::int64_t update_status = 0;
  double wanted_power = 0.0;
  double power_reference = 0.0;
  std::int64_t solver_status = 0;
  std::int64_t gate = 0;
  std::int64_t iterations = 0;
  std::int64_t limit_active = 0;
  double allowed_power = 0.0;
  std::int64_t safety_reason = 0;
  std::int64_t open_interlock = 0;
  std::int64_t sample_usable = 0;
  std::int64_t sample_verdict = 0;
  double believed_power = 0.0;
  std::int64_t safety_state = 0;
  std::int64_t stop_reason = 0;
  std::int64_t detections = 0;
  double energy = 0.0;
  double exposure = 0.0;
  double dose = 0.0;
  std::int64_t overrun = 0;
  double next_power = kNone;  // written at the end of this cycle's work
  std::int64_t device_status = 0;
  std::int64_t saturated = 0;
  std::int64_t stop_asked = 0;
  std::int64_t periods_behind = 0;
  std::int64_t raw = 0;
  std::int64_t sequence = 0;
  std::int64_t sample_time = 0;
  std::int64_t fetched_time = 0;
  double readback = kNone;
  std::int64_t interlock_closed = 1;
  std::int64_t shutter_open = 1;
  std::int64_t foot_switch = 1;
  std::int64_t wake_late = kNoTime;
  std::int64_t compute = kNoTime;
  std::int64_t write = kNoTime;
  std::int64_t slack = kNoTime;
  double device_command = kNone;  // in force during the cycle, as the device says
  std::int64_t late_commands = 0;
};
static_assert(std::is_trivially_copyable_v<LogRecord> && std::is_standard_layout_v<LogRecord>);
static_assert(sizeof(LogRecord) % 8 == 0);

enum class LogFieldType : std::uint8_t { kReal, kInteger };

struct LogField {
  std::string_view name;
  std::string_view unit;
  LogFieldType type;
};

/// Version of the table below. Readers go by name, so that a new field breaks nothing. Before 3 the
/// true temperatures of a device, which does not tell them, were 0 instead of NaN.
inline constexpr int kLogSchema = 3;

/// In the order of LogRecord's members.
inline constexpr std::array<LogField, sizeof(LogRecord) / 8> kLogFields = {{
    {"record", "1", LogFieldType::kInteger},
    {"cycle", "1", LogFieldType::kInteger},
    {"time_s", "s", LogFieldType::kReal},
    {"power_W", "W", LogFieldType::kReal},
    {"volume_true_K", "K", LogFieldType::kReal},
    {"peak_true_K", "K", LogFieldType::kReal},
    {"volume_measured_K", "K", LogFieldType::kReal},
    {"volume_estimate_K", "K", LogFieldType::kReal},
    {"peak_estimate_K", "K", LogFieldType::kReal},
    {"peak_sigma_K", "K", LogFieldType::kReal},
    {"absorption_estimate", "1", LogFieldType::kReal},
    {"absorption_sigma", "1", LogFieldType::kReal},
    {"choroid_estimate", "1", LogFieldType::kReal},
    {"choroid_sigma", "1", LogFieldType::kReal},
    {"update_status", "1", LogFieldType::kInteger},
    {"wanted_power_W", "W", LogFieldType::kReal},
    {"power_reference_W", "W", LogFieldType::kReal},
    {"solver_status", "1", LogFieldType::kInteger},
    {"gate", "1", LogFieldType::kInteger},
    {"solver_iterations", "1", LogFieldType::kInteger},
    {"limit_active", "1", LogFieldType::kInteger},
    {"allowed_power_W", "W", LogFieldType::kReal},
    {"safety_reason", "1", LogFieldType::kInteger},
    {"open_interlock", "1", LogFieldType::kInteger},
    {"sample_usable", "1", LogFieldType::kInteger},
    {"sample_verdict", "1", LogFieldType::kInteger},
    {"believed_power_W", "W", LogFieldType::kReal},
    {"safety_state", "1", LogFieldType::kInteger},
    {"stop_reason", "1", LogFieldType::kInteger},
    {"detections", "1", LogFieldType::kInteger},
    {"energy_J", "J", LogFieldType::kReal},
    {"exposure_s", "s", LogFieldType::kReal},
    {"thermal_dose", "1", LogFieldType::kReal},
    {"overrun", "1", LogFieldType::kInteger},
    {"next_power_W", "W", LogFieldType::kReal},
    {"device_status", "1", LogFieldType::kInteger},
    {"saturated", "1", LogFieldType::kInteger},
    {"stop_asked", "1", LogFieldType::kInteger},
    {"periods_behind", "1", LogFieldType::kInteger},
    {"sample_raw", "1", LogFieldType::kInteger},
    {"sample_sequence", "1", LogFieldType::kInteger},
    {"sample_time_ns", "ns", LogFieldType::kInteger},
    {"fetched_time_ns", "ns", LogFieldType::kInteger},
    {"readback_W", "W", LogFieldType::kReal},
    {"interlock_closed", "1", LogFieldType::kInteger},
    {"shutter_open", "1", LogFieldType::kInteger},
    {"foot_switch", "1", LogFieldType::kInteger},
    {"wake_late_ns", "ns", LogFieldType::kInteger},
    {"compute_ns", "ns", LogFieldType::kInteger},
    {"write_ns", "ns", LogFieldType::kInteger},
    {"slack_ns", "ns", LogFieldType::kInteger},
    {"device_command_W", "W", LogFieldType::kReal},
    {"late_commands", "1", LogFieldType::kInteger},
}};

}  // namespace photocoag
