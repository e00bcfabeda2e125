// Role: offline; reading a study's TOML file table by table. Used by study. Real-time promise:
// none.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/source.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {

/// A table of a study's file; every key read is known, the others are errors (only()). Everything
/// throws Error naming file, line, key, what was found and what is accepted. `value` must outlive
/// it.
class StudyTable {
 public:
  StudyTable(const Value& value, std::string name) : value_(value), name_(std::move(name)) {
    if (value.kind != Value::Kind::kTable) refuse(value, name_, "a table");
  }

  void only(std::initializer_list<std::string_view> keys) const {
    for (const Entry& entry : value_.entries) {
      if (std::find(keys.begin(), keys.end(), entry.key) == keys.end()) {
        throw Error(ErrorParts{.where = entry.value.where,
                               .key = key(entry.key),
                               .problem = "unknown key",
                               .accepted = fmt::format("{}", fmt::join(keys, ", "))});
      }
    }
  }
  std::string text(std::string_view name, std::string otherwise = {}) const {
    const Value* found = value_.find(name);
    if (found == nullptr) return otherwise;
    if (found->kind != Value::Kind::kString) refuse(*found, key(name), "a string");
    return found->string;
  }
  std::string required(std::string_view name) const {
    if (value_.find(name) == nullptr) {
      throw Error(
          ErrorParts{.where = value_.where, .key = key(name), .problem = "the key is missing"});
    }
    return text(name);
  }
  std::optional<double> number(std::string_view name) const {
    const Value* found = value_.find(name);
    if (found == nullptr) return {};
    return number_of(*found, key(name));
  }
  int integer(std::string_view name, int otherwise) const {
    const Value* found = value_.find(name);
    if (found == nullptr) return otherwise;
    if (found->kind != Value::Kind::kInteger || found->integer < 0 || found->integer > 1000) {
      refuse(*found, key(name), "a whole number from 0 to 1000");
    }
    return static_cast<int>(found->integer);
  }
  std::vector<std::string> texts(std::string_view name) const {
    std::vector<std::string> all;
    for (const Value* item : items(name)) {
      if (item->kind != Value::Kind::kString) refuse(*item, key(name), "strings");
      all.push_back(item->string);
    }
    return all;
  }
  std::vector<int> integers(std::string_view name) const {
    std::vector<int> all;
    for (const Value* item : items(name)) {
      if (item->kind != Value::Kind::kInteger) refuse(*item, key(name), "whole numbers");
      all.push_back(static_cast<int>(item->integer));
    }
    return all;
  }
  std::vector<double> numbers(std::string_view name) const {
    std::vector<double> all;
    for (const Value* item : items(name)) all.push_back(number_of(*item, key(name)));
    return all;
  }
  std::vector<StudyTable> tables(std::string_view name) const {
    std::vector<StudyTable> all;
    for (const Value* item : items(name)) all.emplace_back(*item, std::string(name));
    return all;
  }
  [[noreturn]] void refuse_key(std::string_view name, std::string accepted) const {
    refuse(*value_.find(name), key(name), std::move(accepted));
  }

 private:
  std::string key(std::string_view name) const {
    return name_.empty() ? std::string(name) : fmt::format("{}.{}", name_, name);
  }
  std::vector<const Value*> items(std::string_view name) const {
    std::vector<const Value*> all;
    const Value* found = value_.find(name);
    if (found == nullptr) return all;
    if (found->kind != Value::Kind::kArray) refuse(*found, key(name), "an array");
    for (const Entry& entry : found->entries) all.push_back(&entry.value);
    return all;
  }
  static double number_of(const Value& value, const std::string& key) {
    if (value.kind == Value::Kind::kInteger) return static_cast<double>(value.integer);
    if (value.kind != Value::Kind::kFloat) refuse(value, key, "a number");
    return value.number;
  }
  [[noreturn]] static void refuse(const Value& value, std::string key, std::string accepted) {
    throw Error(ErrorParts{.where = value.where,
                           .key = std::move(key),
                           .found = value.text,
                           .accepted = std::move(accepted)});
  }

  const Value& value_;
  std::string name_;
};

}  // namespace photocoag
