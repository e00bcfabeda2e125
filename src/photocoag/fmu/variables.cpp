#include "photocoag/fmu/variables.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "photocoag/config/fields.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/run/tissue_margin.hpp"

namespace photocoag {
namespace {

FmuVariable input(std::string name, std::string_view unit, std::string description,
                  std::optional<std::array<double, 2>> range = {}) {
  return {
      std::move(name), FmuType::kFloat64, FmuRole::kInput, unit, std::move(description), {}, range};
}

FmuVariable output(std::string name, std::string_view unit, std::string description,
                   FmuType type = FmuType::kFloat64) {
  return {std::move(name), type, FmuRole::kOutput, unit, std::move(description), {}, {}};
}

std::vector<FmuVariable> eye_signals() {
  return {input("power", "W", "laser power of the coming period, commanded scale",
                std::array{0.0, kMostFmuPower}),
          output("volume_temperature", "K", "sample at the end of the period; NaN: none"),
          output("applied_power", "W", "what is reported as emitted during the period"),
          output("volume_temperature_true", "K", "the same temperature without noise and gain"),
          output("peak_temperature_true", "K", "what no treatment can measure")};
}

std::vector<FmuVariable> controller_signals() {
  return {input("volume_temperature", "K", "sample at the end of the period; NaN: none"),
          input("applied_power", "W", "emitted during the period; NaN: what was commanded"),
          output("power", "W", "of the coming period, commanded scale"),
          output("power_reference", "W", "u_ref of the last solve"),
          output("peak_estimate", "K", "estimated peak temperature"),
          output("peak_sigma", "K", "its standard deviation"),
          output("volume_estimate", "K", "estimated volume temperature"),
          output("absorption_estimate", "", "estimated absorption factor"),
          output("absorption_sigma", "", "its standard deviation"),
          output("solver_status", "", "0 solved, 1 limit relaxed, 2 failed, 3 KKT check failed",
                 FmuType::kInt64),
          output("solver_iterations", "", "changes of the active set", FmuType::kInt64),
          output("limit_active", "", "the peak limit binds in the plan", FmuType::kBoolean),
          output("safety_state", "", "of the supervisor, as in docs/safety.md: 4 treating",
                 FmuType::kInt64),
          output("interlock_open", "", "the supervisor does not trust 0 W by software alone",
                 FmuType::kBoolean)};
}

std::vector<std::string_view> parameter_keys(FmuKind kind, const Config& config) {
  if (kind == FmuKind::kEye) {
    std::vector<std::string_view> keys = {"plant.absorption_factor", "plant.noise_K",
                                          "plant.power_gain", "plant.sample_gain", "run.seed"};
    if (config.plant.tissue.two_parameters()) keys.insert(keys.begin() + 1, "plant.choroid_factor");
    return keys;
  }
  // No parameters if a margin was computed or a prior fitted: both depend on them.
  if (wants_margin(config) || config.uses_prior()) return {};
  std::vector<std::string_view> keys = {"control.peak_reference_K",
                                        "control.peak_max_K",
                                        "control.power_max_W",
                                        "control.power_min_W",
                                        "control.power_weight",
                                        "control.power_change_weight",
                                        "control.first_power_W",
                                        "estimator.absorption_initial",
                                        "estimator.absorption_sigma_initial",
                                        "estimator.absorption_process_noise",
                                        "estimator.measurement_noise_K"};
  if (config.safety.supervised) keys.emplace_back("plant.noise_K");
  return keys;
}

const Field& field_of(const std::vector<Field>& all, std::string_view key) {
  const auto found =
      std::find_if(all.begin(), all.end(), [key](const Field& field) { return field.key == key; });
  if (found == all.end())
    throw Error(ErrorParts{.key = std::string(key), .problem = "no such key"});
  return *found;
}

FmuVariable parameter(const Field& field) {
  FmuVariable variable{
      .name = field.key, .role = FmuRole::kParameter, .description = std::string(field.meaning)};
  if (const auto* number = std::get_if<NumberField>(&field.value)) {
    variable.unit = number->unit.name;
    variable.start.number = *number->value;
    variable.range = {number->range.low, number->range.high};
  } else {
    variable.type = FmuType::kInt64;
    variable.start.whole = std::get<IntegerField>(field.value).get();
  }
  return variable;
}

}  // namespace

std::string_view to_string(FmuKind kind) noexcept {
  return kind == FmuKind::kEye ? "eye" : "controller";
}

std::vector<FmuVariable> fmu_variables(FmuKind kind, const Config& config) {
  std::vector<FmuVariable> all = {{.name = "time",
                                   .role = FmuRole::kTime,
                                   .unit = "s",
                                   .description = "since the start of the simulation"}};
  for (FmuVariable& signal : kind == FmuKind::kEye ? eye_signals() : controller_signals()) {
    all.push_back(std::move(signal));
  }
  Config bound = config;
  const std::vector<Field> known = fields(bound);
  for (const std::string_view key : parameter_keys(kind, config)) {
    all.push_back(parameter(field_of(known, key)));
  }
  return all;
}

std::vector<FmuVariable> fmu_source_variables() {
  constexpr std::string_view kLeftOut[] = {"volume_estimate", "absorption_sigma", "safety_state",
                                           "interlock_open"};
  std::vector<FmuVariable> all = fmu_variables(FmuKind::kController, {});
  std::erase_if(all, [&](const FmuVariable& one) {
    return one.role == FmuRole::kParameter ||
           std::find(std::begin(kLeftOut), std::end(kLeftOut), one.name) != std::end(kLeftOut);
  });
  return all;
}

FmuLayout fmu_layout(FmuKind kind) noexcept {
  return kind == FmuKind::kEye ? FmuLayout{1, 4} : FmuLayout{2, 12};
}

void set_fmu_parameter(Config& config, const std::string& key, const FmuValue& value) {
  const std::vector<Field> known = fields(config);
  const Field& field = field_of(known, key);
  if (const auto* number = std::get_if<NumberField>(&field.value)) {
    *number->value = value.number;
  } else {
    const auto& integer = std::get<IntegerField>(field.value);
    if (value.whole < integer.low || value.whole > integer.high) {
      throw Error(ErrorParts{
          .key = key, .found = std::to_string(value.whole), .accepted = accepted(field)});
    }
    integer.set(value.whole);
  }
}

std::optional<SiUnit> si_unit(std::string_view unit) noexcept {
  constexpr std::pair<std::string_view, SiUnit> kUnits[] = {
      {"", {}},
      {"periods", {}},
      {"s", {.s = 1}},
      {"ms", {.s = 1, .factor = 1e-3}},
      {"1/s", {.s = -1}},
      {"um", {.m = 1, .factor = 1e-6}},
      {"1/m", {.m = -1}},
      {"K", {.K = 1}},
      {"deg C", {.K = 1, .offset = 273.15}},
      {"W", {.kg = 1, .m = 2, .s = -3}},
      {"mJ", {.kg = 1, .m = 2, .s = -2, .factor = 1e-3}},
      {"K2/W2", {.kg = -2, .m = -4, .s = 6, .K = 2}},
      {"kg/m3", {.kg = 1, .m = -3}},
      {"J/(kg K)", {.m = 2, .s = -2, .K = -1}},
      {"W/(m K)", {.kg = 1, .m = 1, .s = -3, .K = -1}},
      {"W/(m3 K)", {.kg = 1, .m = -1, .s = -3, .K = -1}}};
  for (const auto& [name, si] : kUnits) {
    if (name == unit) return si;
  }
  return {};
}

}  // namespace photocoag
