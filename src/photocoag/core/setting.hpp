// Role: setup; one row per key of the configuration: key, unit, range, words and meaning, bound to
// the variable it sets. Each settings aggregate has a fields_of(): reading, printing, schema,
// documentation and range checks all come from it. Used by every settings aggregate, config. Keys
// carry the unit, the variables are SI.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace photocoag {

struct Layer;  // tissue/tissue.hpp

/// The unit of a key: SI value = written value * 10^exponent.
struct Unit {
  std::string_view name;
  int exponent = 0;
};

/// Bounds in the key's unit.
struct Range {
  double low;
  double high;
  bool above_low = false;      ///< low itself is excluded
  std::string_view hint = {};  ///< for messages
};

struct NumberField {
  double* value;
  Unit unit;
  Range range;
};
/// A key that may be absent: then it is not printed, and the meaning says what holds instead.
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
  std::vector<std::string_view> unavailable = {};  ///< known words that this build does not support
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

/// Rows below one prefix, e.g. "control".
class FieldTable {
 public:
  explicit FieldTable(std::string_view prefix) : prefix_(prefix) {}

  void number(std::string_view name, double& value, Unit unit, Range range,
              std::string_view meaning) {
    add(name, NumberField{&value, unit, range}, meaning);
  }
  void optional_number(std::string_view name, std::optional<double>& value, Unit unit, Range range,
                       std::string_view meaning) {
    add(name, OptionalNumberField{&value, unit, range}, meaning);
  }
  void numbers(std::string_view name, std::vector<double>& values, Unit unit, Range range,
               std::string_view meaning) {
    add(name, NumbersField{&values, unit, range}, meaning);
  }
  template <class T>
  void integer(std::string_view name, T& value, std::int64_t low, std::int64_t high,
               std::string_view meaning) {
    add(name,
        IntegerField{[&value] { return static_cast<std::int64_t>(value); },
                     [&value](std::int64_t read) { value = static_cast<T>(read); }, low, high},
        meaning);
  }
  /// `words` in the order of the enumerators.
  template <class E>
  void word(std::string_view name, E& value, std::vector<std::string_view> words,
            std::string_view meaning) {
    add(name,
        WordField{std::move(words),
                  [&value] { return static_cast<std::size_t>(value); },
                  [&value](std::size_t index) { value = static_cast<E>(index); },
                  {}},
        meaning);
  }
  void text(std::string_view name, std::string& value, std::string_view meaning) {
    add(name, TextField{&value, false}, meaning);
  }
  void path(std::string_view name, std::string& value, std::string_view meaning) {
    add(name, TextField{&value, true}, meaning);
  }
  void add(std::string_view name, decltype(Field::value) value, std::string_view meaning);

  std::vector<Field> take() { return std::move(list_); }

 private:
  std::string prefix_;
  std::vector<Field> list_;
};

/// What the field accepts, in words with the unit: "a number from 0.05 to 100 ms".
std::string accepted(const Field& field);

/// The range alone, for comments: "0.05 to 100 ms".
std::string range_text(const Field& field);

/// Throws Error{key, found, accepted} unless every number is finite and within its range.
void require_in_range(const std::vector<Field>& fields);

/// Units that several keys share.
namespace units {
inline constexpr Unit kOne{""};
inline constexpr Unit kMilliseconds{"ms", -3};
inline constexpr Unit kMicrometres{"um", -6};
inline constexpr Unit kKelvin{"K"};
inline constexpr Unit kWatt{"W"};
inline constexpr Unit kPeriods{"periods"};
}  // namespace units

}  // namespace photocoag
