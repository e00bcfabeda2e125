// A field's value as it is written in TOML.
#include <fmt/format.h>

#include "photocoag/config/decimal.hpp"
#include "photocoag/config/fields.hpp"
#include "photocoag/config/source.hpp"

namespace photocoag {

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
  if (const auto* w = std::get_if<WordField>(&field.value))
    return toml_quoted(w->words.at(w->get()));
  if (const auto* t = std::get_if<TextField>(&field.value)) return toml_quoted(*t->value);
  return "";
}

}  // namespace photocoag
