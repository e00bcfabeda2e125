#include "photocoag/log/fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <concepts>
#include <utility>

namespace photocoag {
namespace {

constexpr UpdateStatus last_of(UpdateStatus) { return UpdateStatus::kRestarted; }
constexpr MpcStatus last_of(MpcStatus) { return MpcStatus::kStopped; }
constexpr GateVerdict last_of(GateVerdict) { return GateVerdict::kOutside; }
constexpr SafetyReason last_of(SafetyReason) { return SafetyReason::kCommandLate; }
constexpr SafetyState last_of(SafetyState) { return SafetyState::kSafeStop; }
constexpr DeviceStatus last_of(DeviceStatus) { return DeviceStatus::kGone; }

template <typename T>
concept Worded = std::is_enum_v<T> && requires(T value) {
  { to_string(value) } -> std::same_as<std::string_view>;
};

template <typename T>
std::uint64_t bits_of(T value) noexcept {
  if constexpr (std::floating_point<T>) {
    return std::bit_cast<std::uint64_t>(value);
  } else {
    return static_cast<std::uint64_t>(value);
  }
}

template <typename T>
T value_of(std::uint64_t bits) noexcept {
  if constexpr (std::floating_point<T>) {
    return std::bit_cast<T>(bits);
  } else if constexpr (std::is_enum_v<T>) {
    return bits <= static_cast<std::uint64_t>(last_of(T{})) ? static_cast<T>(bits) : T{};
  } else if constexpr (std::same_as<T, bool>) {
    return bits != 0;
  } else {
    return static_cast<T>(bits);
  }
}

/// The value at the end of a path of members.
template <auto... path>
constexpr auto& at(auto& record) noexcept {
  return (record.*....*path);
}

template <auto... path>
constexpr CycleField field(std::string_view name, std::string_view unit, InCsv in_csv,
                           std::string_view formerly = {}) {
  using T = std::remove_reference_t<decltype(at<path...>(std::declval<LogRecord&>()))>;
  CycleField f{.name = name,
               .unit = unit,
               .type = std::floating_point<T> ? FieldType::kReal : FieldType::kInteger,
               .in_csv = in_csv,
               .get = [](const LogRecord& record) noexcept { return bits_of(at<path...>(record)); },
               .set = [](LogRecord& record,
                         std::uint64_t bits) noexcept { at<path...>(record) = value_of<T>(bits); },
               .word = nullptr,
               .formerly = formerly};
  if constexpr (Worded<T>) {
    f.type = FieldType::kWord;
    f.word = [](std::uint64_t bits) noexcept { return to_string(value_of<T>(bits)); };
  }
  return f;
}

using enum InCsv;

constexpr auto kFields = std::to_array<CycleField>({
    field<&LogRecord::record>("record", "1", kNo),
    field<&CycleRecord::cycle>("cycle", "1", kYes),
    field<&CycleRecord::time>("time_s", "s", kYes),
    field<&CycleRecord::power>("power_W", "W", kYes),
    field<&CycleRecord::truth, &Outputs::volume>("volume_true_K", "K", kMayBeEmpty),
    field<&CycleRecord::measured>("volume_measured_K", "K", kMayBeEmpty),
    field<&CycleRecord::estimate, &Estimate::outputs, &Outputs::volume>("volume_estimate_K", "K",
                                                                        kYes),
    field<&CycleRecord::truth, &Outputs::peak>("peak_true_K", "K", kMayBeEmpty),
    field<&CycleRecord::estimate, &Estimate::outputs, &Outputs::peak>("peak_estimate_K", "K", kYes),
    field<&CycleRecord::estimate, &Estimate::absorption_factor>("absorption_estimate", "1", kYes),
    field<&CycleRecord::estimate, &Estimate::absorption_sigma>("absorption_sigma", "1", kYes),
    field<&CycleRecord::decision, &Decision::power_reference>("power_reference_W", "W", kYes),
    field<&CycleRecord::decision, &Decision::status>("solver_status", "1", kYes),
    field<&CycleRecord::decision, &Decision::iterations>("solver_iterations", "1", kYes),
    field<&CycleRecord::estimate, &Estimate::peak_sigma>("peak_sigma_K", "K", kYes),
    field<&CycleRecord::decision, &Decision::limit_active>("limit_active", "1", kYes),
    field<&CycleRecord::overrun>("overrun", "1", kYes),
    field<&CycleRecord::safety>("safety_state", "1", kYes),
    field<&CycleRecord::authorization, &Authorization::reason>("safety_reason", "1", kYes),
    field<&CycleRecord::sample, &SampleVerdict::reason>("sample_verdict", "1", kYes),
    field<&CycleRecord::estimate, &Estimate::choroid_factor>("choroid_estimate", "1", kWithChoroid),
    field<&CycleRecord::estimate, &Estimate::choroid_sigma>("choroid_sigma", "1", kWithChoroid),
    field<&CycleRecord::authorization, &Authorization::power>("power_command_W", "W", kWithDevice,
                                                              "allowed_power_W"),
    field<&CycleRecord::device_command>("device_command_W", "W", kWithDevice),
    field<&CycleRecord::estimate, &Estimate::status>("update_status", "1", kNo),
    field<&CycleRecord::decision, &Decision::power>("wanted_power_W", "W", kNo),
    field<&CycleRecord::decision, &Decision::gate>("gate", "1", kNo),
    field<&CycleRecord::authorization, &Authorization::open_interlock>("open_interlock", "1", kNo),
    field<&CycleRecord::sample, &SampleVerdict::usable>("sample_usable", "1", kNo),
    field<&CycleRecord::sample, &SampleVerdict::power>("believed_power_W", "W", kNo),
    field<&LogRecord::end, &CycleEnd::safety, &SafetyStatus::reason>("stop_reason", "1", kNo),
    field<&LogRecord::end, &CycleEnd::safety, &SafetyStatus::detections>("detections", "1", kNo),
    field<&LogRecord::end, &CycleEnd::safety, &SafetyStatus::energy>("energy_J", "J", kNo),
    field<&LogRecord::end, &CycleEnd::safety, &SafetyStatus::exposure>("exposure_s", "s", kNo),
    field<&LogRecord::end, &CycleEnd::safety, &SafetyStatus::dose>("thermal_dose", "1", kNo),
    field<&LogRecord::end, &CycleEnd::next_power>("next_power_W", "W", kNo),
    field<&LogRecord::end, &CycleEnd::sample, &DeviceSample::status>("device_status", "1", kNo),
    field<&LogRecord::end, &CycleEnd::sample, &DeviceSample::saturated>("saturated", "1", kNo),
    field<&LogRecord::end, &CycleEnd::sample, &DeviceSample::stop_asked>("stop_asked", "1", kNo),
    field<&LogRecord::end, &CycleEnd::sample, &DeviceSample::periods_behind>("periods_behind", "1",
                                                                             kNo),
    field<&LogRecord::end, &CycleEnd::sample, &DeviceSample::raw>("sample_raw", "1", kNo),
    field<&LogRecord::end, &CycleEnd::sample, &DeviceSample::sequence>("sample_sequence", "1", kNo),
    field<&LogRecord::end, &CycleEnd::sample, &DeviceSample::time_ns>("sample_time_ns", "ns", kNo),
    field<&LogRecord::end, &CycleEnd::sample, &DeviceSample::now_ns>("fetched_time_ns", "ns", kNo),
    field<&LogRecord::end, &CycleEnd::readback, &Readback::power>("readback_W", "W", kNo),
    field<&LogRecord::end, &CycleEnd::readback, &Readback::interlock_closed>("interlock_closed",
                                                                             "1", kNo),
    field<&LogRecord::end, &CycleEnd::readback, &Readback::shutter_open>("shutter_open", "1", kNo),
    field<&LogRecord::end, &CycleEnd::readback, &Readback::foot_switch>("foot_switch", "1", kNo),
    field<&LogRecord::wake_late>("wake_late_ns", "ns", kNo),
    field<&LogRecord::compute>("compute_ns", "ns", kNo),
    field<&LogRecord::write>("write_ns", "ns", kNo),
    field<&LogRecord::slack>("slack_ns", "ns", kNo),
    field<&LogRecord::end, &CycleEnd::volume_predicted>("volume_predicted_K", "K", kNo),
    field<&LogRecord::end, &CycleEnd::safety, &SafetyStatus::late_commands>("late_commands", "1",
                                                                            kNo),
    field<&LogRecord::end, &CycleEnd::innovation_sigma>("innovation_sigma_K", "K", kNo),
});

}  // namespace

std::span<const CycleField> cycle_fields() noexcept { return kFields; }

const CycleField* field_named(std::string_view name) noexcept {
  const auto* const found = std::find_if(kFields.begin(), kFields.end(),
                                         [name](const CycleField& f) { return f.name == name; });
  return found == kFields.end() ? nullptr : found;
}

std::size_t log_record_bytes() noexcept { return 8 * kFields.size(); }

std::string cell_of(const CycleField& field, const LogRecord& record) {
  const std::uint64_t bits = field.get(record);
  if (field.type == FieldType::kWord) return std::string(field.word(bits));
  if (field.type == FieldType::kInteger) {
    return fmt::format("{}", static_cast<std::int64_t>(bits));
  }
  const auto value = std::bit_cast<double>(bits);
  const bool empty = field.in_csv == kMayBeEmpty || field.in_csv == kWithDevice;
  return empty && !std::isfinite(value) ? std::string() : fmt::format("{}", value);
}

namespace {

template <typename Number>
bool read(std::string_view cell, Number& number) {
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), number);
  return error == std::errc() && end == cell.data() + cell.size();
}

/// Code of the word in `cell`.
bool read_word(const CycleField& field, std::string_view cell, std::int64_t& number) {
  constexpr std::int64_t kMostWords = 64;
  for (number = 0; number < kMostWords; ++number) {
    if (field.word(static_cast<std::uint64_t>(number)) == cell) return true;
  }
  return false;
}

}  // namespace

bool set_cell(const CycleField& field, std::string_view cell, LogRecord& record) {
  if (field.type == FieldType::kReal) {
    double value = LogRecord::kNone;
    if (!cell.empty() && !read(cell, value)) return false;
    field.set(record, std::bit_cast<std::uint64_t>(value));
    return true;
  }
  std::int64_t number = 0;
  const bool good = field.type == FieldType::kWord ? read_word(field, cell, number)
                                                   : cell.empty() || read(cell, number);
  if (good) field.set(record, static_cast<std::uint64_t>(number));
  return good;
}

}  // namespace photocoag
