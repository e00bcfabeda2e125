#include "photocoag/config/assign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "photocoag/config/decimal.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/utf8.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse_value(const Field& field, const Value& value, std::string problem = {}) {
  throw Error({.where = value.where,
               .key = field.key,
               .problem = std::move(problem),
               .found = shown(value.text),
               .accepted = accepted(field)});
}

// In SI.
double read_number(const Field& field, const Unit& unit, const Value& value) {
  if (value.kind == Value::Kind::kInteger) {
    return scaled_decimal(fmt::format("{}", value.integer), unit.exponent);
  }
  if (value.kind != Value::Kind::kFloat) refuse_type(field.key, value, accepted(field));
  if (!std::isfinite(value.number)) refuse_value(field, value);
  return scaled_decimal(value.text, unit.exponent);
}

void assign_numbers(const Field& field, const NumbersField& target, const Value& value) {
  if (value.kind != Value::Kind::kArray) refuse_type(field.key, value, accepted(field));
  std::vector<double> numbers;
  for (const Entry& element : value.entries) {
    numbers.push_back(read_number(field, target.unit, element.value));
  }
  *target.values = std::move(numbers);
}

void assign_integer(const Field& field, const IntegerField& target, const Value& value) {
  if (value.kind != Value::Kind::kInteger) refuse_type(field.key, value, accepted(field));
  if (value.integer < target.low || value.integer > target.high) refuse_value(field, value);
  target.set(value.integer);
}

void assign_word(const Field& field, const WordField& target, const Value& value) {
  if (value.kind != Value::Kind::kString) refuse_type(field.key, value, accepted(field));
  const auto contains = [&value](const std::vector<std::string_view>& words) {
    return std::find(words.begin(), words.end(), value.string);
  };
  if (contains(target.unavailable) != target.unavailable.end()) {
    refuse_value(field, value,
                 "not available in this build, which found no OSQP 0.6 (CONTRIBUTING.md, Build)");
  }
  const auto word = contains(target.words);
  if (word != target.words.end()) {
    target.set(static_cast<std::size_t>(word - target.words.begin()));
    return;
  }
  refuse_value(field, value);
}

void assign_text(const Field& field, const TextField& target, const Value& value,
                 const std::string& folder) {
  constexpr std::size_t kMostName = 100;
  constexpr std::size_t kMostPath = 4096;
  if (value.kind != Value::Kind::kString) refuse_type(field.key, value, accepted(field));
  const std::string& text = value.string;
  if (text.size() > (target.is_path ? kMostPath : kMostName)) {
    refuse_value(field, value, fmt::format("{} bytes long", text.size()));
  }
  const bool has_control = std::any_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < ' ' || c == '\x7F';
  });
  if (has_control) refuse_value(field, value, "a control character");
  *target.value = text;
  if (!target.is_path || text.empty()) return;
  *target.value = (fs::path(folder) / text).lexically_normal().string();
  if (!is_utf8(*target.value)) refuse_value(field, value, "the name of its folder is not UTF-8");
}

}  // namespace

void refuse_type(const std::string& key, const Value& value, std::string accepted) {
  throw Error({.where = value.where,
               .key = key,
               .found = fmt::format("{} ({})", shown(value.text), kind_name(value.kind)),
               .accepted = std::move(accepted)});
}

void assign(const Field& field, const Value& value, const std::string& folder) {
  if (const auto* number = std::get_if<NumberField>(&field.value)) {
    *number->value = read_number(field, number->unit, value);
  } else if (const auto* optional = std::get_if<OptionalNumberField>(&field.value)) {
    *optional->value = read_number(field, optional->unit, value);
  } else if (const auto* numbers = std::get_if<NumbersField>(&field.value)) {
    assign_numbers(field, *numbers, value);
  } else if (const auto* integer = std::get_if<IntegerField>(&field.value)) {
    assign_integer(field, *integer, value);
  } else if (const auto* word = std::get_if<WordField>(&field.value)) {
    assign_word(field, *word, value);
  } else if (const auto* text = std::get_if<TextField>(&field.value)) {
    assign_text(field, *text, value, folder);
  }
}

}  // namespace photocoag
