// Role: setup; the one table of all configuration keys: it drives reading, printing, the detection
// of unknown keys and the documentation. Used by config. A field is bound to the variable it sets;
// keys carry the unit, the variables are SI.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "photocoag/config/config.hpp"

namespace photocoag {

/// The unit of a key: SI value = written value * 10^exponent.
struct Unit {
  std::string_view name;
  int exponent = 0;
};

/// Stated here for the printed configuration; enforced by the settings' validate() (a test holds
/// the two together).
struct Range {
  double low;
  double high;
  bool above_low = false;  ///< low itself is excluded
};

struct NumberField {
  double* value;
  Unit unit;
  Range range;
};
/// Not given: printed nowhere, the meaning says what holds instead.
struct OptionalNumberField {
  std::optional<double>* value;
  Unit unit;
  Range range;
};
struct NumbersField {
  std::vector<double>* values;
  Unit unit;
  Range range;  ///< of each
};
struct IntegerField {
  std::function<std::int64_t()> get;
  std::function<void(std::int64_t)> set;
  std::int64_t low;
  std::int64_t high;
};
struct WordField {
  std::vector<std::string_view> words;
  std::function<std::size_t()> get;  ///< index of the word
  std::function<void(std::size_t)> set;
  std::vector<std::string_view> unavailable = {};  ///< known words that this build cannot serve
};
struct TextField {
  std::string* value;
  bool is_path = false;
};
struct LayersField {
  std::vector<Layer>* layers;
};

struct Field {
  std::string key;  ///< full, e.g. "control.period_ms"
  std::variant<NumberField, OptionalNumberField, NumbersField, IntegerField, WordField, TextField,
               LayersField>
      value;
  std::string_view meaning;
};

struct Section {
  std::string_view name;  ///< "control", …, "plant.tissue"
  std::string_view meaning;
};

/// In the order in which they are printed.
const std::vector<Section>& sections();

/// Every key but those inside layers, bound to `config`, section by section.
std::vector<Field> fields(Config& config);

/// The keys of one layer, below `prefix` (e.g. "tissue.layers.RPE").
std::vector<Field> layer_fields(Layer& layer, const std::string& prefix);

/// Those that every layer of an array needs.
inline constexpr std::array<const char*, 3> kRequiredLayerKeys = {"name", "thickness_um",
                                                                  "absorption_per_m"};

/// The value as it is written in TOML; empty: an optional one that is not given, or layers.
std::string value_text(const Field& field);

/// What the field accepts, in words with the unit: "a number from 0.05 to 100 ms".
std::string accepted(const Field& field);

/// The range alone, for comments: "0.05 to 100 ms".
std::string range_text(const Field& field);

}  // namespace photocoag
