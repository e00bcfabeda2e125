#include "photocoag/config/table_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

// NaN if it is not a number.
double number_of(const Value& value) {
  if (value.kind == Value::Kind::kInteger) return static_cast<double>(value.integer);
  return value.kind == Value::Kind::kFloat ? value.number : std::nan("");
}

}  // namespace

TableReader::TableReader(const Value& table, std::string path)
    : table_(table), path_(std::move(path)) {
  if (table.kind == Value::Kind::kTable) return;
  throw Error(ErrorParts{
      .where = table.where, .key = path_, .found = shown(table.text), .accepted = "a table"});
}

TableReader::TableReader(const Value& table, std::string path,
                         std::initializer_list<std::string_view> keys)
    : TableReader(table, std::move(path)) {
  only(keys);
}

void TableReader::only(std::initializer_list<std::string_view> keys) const {
  for (const Entry& entry : table_.entries) {
    if (std::find(keys.begin(), keys.end(), entry.key) != keys.end()) continue;
    throw Error(ErrorParts{.where = entry.value.where,
                           .key = full(shown(entry.key)),
                           .problem = "unknown key",
                           .accepted = fmt::format("{}", fmt::join(keys, ", "))});
  }
}

const Value& TableReader::required(std::string_view key) const {
  if (const Value* value = find(key)) return *value;
  throw Error(ErrorParts{.where = table_.where, .key = full(key), .problem = "the key is missing"});
}

std::string TableReader::text(std::string_view key, std::string otherwise) const {
  return find(key) == nullptr ? std::move(otherwise) : required_text(key);
}

std::string TableReader::required_text(std::string_view key) const {
  const Value& value = required(key);
  require(value.kind == Value::Kind::kString, key, "a string");
  return value.string;
}

bool TableReader::flag(std::string_view key, bool otherwise) const {
  const Value* value = find(key);
  if (value == nullptr) return otherwise;
  require(value->kind == Value::Kind::kBoolean, key, "true or false");
  return value->text == "true";
}

std::string TableReader::word(std::string_view key, std::initializer_list<std::string_view> words,
                              std::string_view otherwise) const {
  if (find(key) == nullptr) return std::string(otherwise);
  const std::string word = required_text(key);
  if (std::find(words.begin(), words.end(), word) != words.end()) return word;
  refuse(key, fmt::format("\"{}\"", fmt::join(words, "\" or \"")));
}

std::optional<double> TableReader::number(std::string_view key, double low, double high) const {
  const Value* value = find(key);
  if (value == nullptr) return std::nullopt;
  const double number = number_of(*value);
  if (number >= low && number <= high) return number;
  refuse(key, high == std::numeric_limits<double>::max()
                  ? std::string("a finite number")
                  : fmt::format("a number from {:g} to {:g}", low, high));
}

double TableReader::required_number(std::string_view key) const {
  required(key);
  return *number(key);
}

std::optional<std::uint64_t> TableReader::count(std::string_view key, std::int64_t low,
                                                std::int64_t high) const {
  const Value* value = find(key);
  if (value == nullptr) return std::nullopt;
  const bool good =
      value->kind == Value::Kind::kInteger && value->integer >= low && value->integer <= high;
  require(good, key,
          high == std::numeric_limits<std::int64_t>::max()
              ? fmt::format("a whole number from {} on", low)
              : fmt::format("a whole number from {} to {}", low, high));
  return static_cast<std::uint64_t>(value->integer);
}

int TableReader::integer(std::string_view key, int low, int high, int otherwise) const {
  const auto value = count(key, low, high);
  return value ? static_cast<int>(*value) : otherwise;
}

std::vector<int> TableReader::integers(std::string_view key) const {
  std::vector<int> list;
  for (const Entry& entry : items(key, "an array of whole numbers")) {
    if (entry.value.kind != Value::Kind::kInteger) refuse(entry.value, key, "a whole number");
    list.push_back(static_cast<int>(entry.value.integer));
  }
  return list;
}

std::vector<std::string> TableReader::texts(std::string_view key) const {
  std::vector<std::string> list;
  for (const Entry& entry : items(key, "an array of strings")) {
    if (entry.value.kind != Value::Kind::kString) refuse(entry.value, key, "a string");
    list.push_back(entry.value.string);
  }
  return list;
}

std::vector<double> TableReader::numbers(std::string_view key) const {
  std::vector<double> list;
  for (const Entry& entry : items(key, "an array of numbers")) {
    list.push_back(number_of(entry.value));
    if (!std::isfinite(list.back())) refuse(entry.value, key, "a number");
  }
  return list;
}

std::vector<TableReader> TableReader::tables(std::string_view key) const {
  std::vector<TableReader> list;
  for (const Entry& entry : items(key, "an array of tables")) {
    list.emplace_back(entry.value, std::string(key));
  }
  return list;
}

void TableReader::refuse(std::string_view key, std::string accepted) const {
  refuse(required(key), key, std::move(accepted));
}

void TableReader::require(bool good, std::string_view key, std::string accepted) const {
  if (!good) refuse(key, std::move(accepted));
}

std::string TableReader::full(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

const std::vector<Entry>& TableReader::items(std::string_view key, const char* accepted) const {
  static const std::vector<Entry> none;
  const Value* value = find(key);
  if (value == nullptr) return none;
  require(value->kind == Value::Kind::kArray, key, accepted);
  return value->entries;
}

void TableReader::refuse(const Value& value, std::string_view key, std::string accepted) const {
  throw Error(ErrorParts{.where = value.where,
                         .key = full(key),
                         .found = shown(value.text),
                         .accepted = std::move(accepted)});
}

}  // namespace photocoag
