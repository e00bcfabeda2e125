#include "photocoag/core/setting.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/check.hpp"

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

// In the key's unit; an exponent is 0, -3 or -6.
double written(double value, const Unit& unit) {
  return unit.exponent == 0 ? value : value * std::pow(10.0, -unit.exponent);
}

bool within(double value, const Range& range) {
  return std::isfinite(value) && value <= range.high &&
         (range.above_low ? value > range.low : value >= range.low);
}

void require_in_range(const Field& field) {
  const auto check = [&field](double value, const Unit& unit, const Range& range) {
    if (const double found = written(value, unit); !within(found, range)) {
      require(false, field.key, found, accepted(field));
    }
  };
  if (const auto* n = std::get_if<NumberField>(&field.value)) {
    check(*n->value, n->unit, n->range);
  } else if (const auto* o = std::get_if<OptionalNumberField>(&field.value)) {
    if (o->value->has_value()) check(**o->value, o->unit, o->range);
  } else if (const auto* list = std::get_if<NumbersField>(&field.value)) {
    for (const double value : *list->values) check(value, list->unit, list->range);
  } else if (const auto* i = std::get_if<IntegerField>(&field.value)) {
    const std::int64_t value = i->get();
    require(value >= i->low && value <= i->high, field.key, std::to_string(value), accepted(field));
  }
}

}  // namespace

void FieldTable::add(std::string_view name, decltype(Field::value) value,
                     std::string_view meaning) {
  list_.push_back({fmt::format("{}.{}", prefix_, name), std::move(value), meaning});
}

std::string range_text(const Field& field) {
  if (const auto* n = std::get_if<NumberField>(&field.value)) return range_words(n->range, n->unit);
  if (const auto* n = std::get_if<OptionalNumberField>(&field.value)) {
    return range_words(n->range, n->unit);
  }
  if (const auto* n = std::get_if<NumbersField>(&field.value)) {
    return range_words(n->range, n->unit);
  }
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
    return (range.above_low ? "a number " : "a number from ") + range_words(range, unit) +
           (range.hint.empty() ? "" : fmt::format(" ({})", range.hint));
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

void require_in_range(const std::vector<Field>& fields) {
  for (const Field& field : fields) require_in_range(field);
}

}  // namespace photocoag
