// Role: setup; the variables of the two FMUs and the SI units of the configuration. Used by fmu
// (the FMU's library and its model description: one table for both). Source: docs/fmu.md. Units: of
// the configuration's keys. Allocates.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/config.hpp"

namespace photocoag {

enum class FmuKind : std::uint8_t { kEye, kController };

/// "eye", "controller".
std::string_view to_string(FmuKind kind) noexcept;

enum class FmuType : std::uint8_t { kFloat64, kInt64, kBoolean };

enum class FmuRole : std::uint8_t {
  kTime,
  kInput,
  kOutput,
  kParameter,  ///< a key of the configuration; fixed once the simulation has begun
};

/// A value of any type; a Boolean is 0 or 1 in `whole`.
struct FmuValue {
  double number = 0.0;
  std::int64_t whole = 0;
};

struct FmuVariable {
  std::string name;  ///< of a parameter: the configuration's key
  FmuType type = FmuType::kFloat64;
  FmuRole role = FmuRole::kOutput;
  std::string_view unit = {};  ///< as in the configuration's table; empty: 1
  std::string description = {};
  FmuValue start = {};
  std::optional<std::array<double, 2>> range = {};  ///< least and largest value
};

/// W, largest power of the eye.
inline constexpr double kMostFmuPower = 10.0;

/// References are indices into the list: time, inputs, outputs, parameters.
std::vector<FmuVariable> fmu_variables(FmuKind kind, const Config& config);

/// Variables of the controller as C sources: fewer outputs, no parameters. In the order of the
/// enumeration in src/fmu/c/fmi3_controller.c.
std::vector<FmuVariable> fmu_source_variables();

/// Numbers of inputs and outputs; inputs begin at kFirstFmuInput, outputs follow.
struct FmuLayout {
  std::size_t inputs = 0;
  std::size_t outputs = 0;
};
inline constexpr std::size_t kFirstFmuInput = 1;
FmuLayout fmu_layout(FmuKind kind) noexcept;

/// Assigns a parameter's value to its configuration key. Throws Error if there is no such key.
void set_fmu_parameter(Config& config, const std::string& key, const FmuValue& value);

/// Powers of kg, m, s, K and the factor of a unit of the configuration's table.
struct SiUnit {
  int kg = 0;
  int m = 0;
  int s = 0;
  int K = 0;
  double factor = 1.0;
  double offset = 0.0;  ///< of "deg C"
};

/// nullopt: not a unit of the table.
std::optional<SiUnit> si_unit(std::string_view unit) noexcept;

}  // namespace photocoag
