// A field's value and what it accepts, in words: for messages, the printed configuration and its
// schema.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "photocoag/config/decimal.hpp"
#include "photocoag/config/fields.hpp"
#include "photocoag/config/source.hpp"

namespace photocoag {
namespace {

std::string round_number(double value) {
  if (std::abs(value) < 1e6) return fmt::format("{}", value);
  return fmt::format("1e{}", std::lround(std::log10(value)));  // the table has powers of ten only
}

std::string range_words(const Range& range, const Unit& of) {
  const std::string low = round_number(range.low);
  const std::string high = round_number(range.high);
  const std::string unit = of.name.empty() ? "" : fmt::format(" {}", of.name);
  return range.above_low ? fmt::format("above {}, at most {}{}", low, high, unit)
                         : fmt::format("{} to {}{}", low, high, unit);
}

std::string word_list(const WordField& field, bool available_only) {
  std::string list;
  for (const std::string_view w : field.words) {
    const auto& missing = field.unavailable;
    if (available_only && std::find(missing.begin(), missing.end(), w) != missing.end()) continue;
    list += fmt::format("{}\"{}\"", list.empty() ? "" : " or ", w);
  }
  return list;
}

}  // namespace

std::string value_text(const Field& field) {
  if (const auto* n = std::get_if<NumberField>(&field.value)) {
    return shortest_decimal(*n->value, n->unit.exponent);
  }
  if (const auto* n = std::get_if<OptionalNumberField>(&field.value)) {
    return n->value->has_value() ? shortest_decimal(**n->value, n->unit.exponent) : "";
  }
  if (const auto* n = std::get_if<NumbersField>(&field.value)) {
    std::string text;
    for (const double value : *n->values) {
      text += (text.empty() ? "" : ", ") + shortest_decimal(value, n->unit.exponent);
    }
    return "[" + text + "]";
  }
  if (const auto* i = std::get_if<IntegerField>(&field.value)) return fmt::format("{}", i->get());
  if (const auto* w = std::get_if<WordField>(&field.value)) return quoted(w->words.at(w->get()));
  if (const auto* t = std::get_if<TextField>(&field.value)) return quoted(*t->value);
  return "";
}

std::string range_text(const Field& field) {
  if (const auto* n = std::get_if<NumberField>(&field.value)) return range_words(n->range, n->unit);
  if (const auto* n = std::get_if<OptionalNumberField>(&field.value)) {
    return range_words(n->range, n->unit);
  }
  if (const auto* n = std::get_if<NumbersField>(&field.value))
    return range_words(n->range, n->unit);
  if (const auto* i = std::get_if<IntegerField>(&field.value)) {
    constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();
    return i->high == kLargest ? fmt::format("{} to 2^63 - 1", i->low)
                               : fmt::format("{} to {}", i->low, i->high);
  }
  if (const auto* w = std::get_if<WordField>(&field.value)) return word_list(*w, false);
  return "";
}

std::string accepted(const Field& field) {
  const auto number = [](const Range& range, const Unit& unit) {
    return (range.above_low ? "a number " : "a number from ") + range_words(range, unit);
  };
  if (const auto* n = std::get_if<NumberField>(&field.value)) return number(n->range, n->unit);
  if (const auto* n = std::get_if<OptionalNumberField>(&field.value)) {
    return number(n->range, n->unit);
  }
  if (const auto* n = std::get_if<NumbersField>(&field.value)) {
    return "an array of numbers, each " + range_words(n->range, n->unit);
  }
  if (std::holds_alternative<IntegerField>(field.value)) {
    return "an integer from " + range_text(field);
  }
  if (const auto* w = std::get_if<WordField>(&field.value)) return word_list(*w, true);
  if (const auto* t = std::get_if<TextField>(&field.value)) {
    return t->is_path ? "a file name in quotes" : "text in quotes, without control characters";
  }
  return "an array of layers, or a table of layers by name";
}

}  // namespace photocoag
