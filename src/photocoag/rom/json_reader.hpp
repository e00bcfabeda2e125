// Role: setup; checked reading of the model file's JSON. Used by rom only (needs nlohmann_json).
#pragma once

#include <fmt/format.h>
#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/core/types.hpp"

namespace photocoag {

using Json = nlohmann::ordered_json;

/// Reads fields; errors name the missing or wrong field by its path in the file.
class JsonReader {
 public:
  JsonReader(const Json& json, std::string_view where, std::string path = {})
      : json_(json), where_(where), path_(std::move(path)) {}

  JsonReader operator[](const std::string& key) const {
    const std::string path = path_.empty() ? key : path_ + "." + key;
    if (!json_.is_object() || !json_.contains(key)) {
      throw Error(
          ErrorParts{.where = where_, .key = path, .problem = "missing from the model file"});
    }
    return JsonReader(json_.at(key), where_, path);
  }

  bool has(const std::string& key) const { return json_.is_object() && json_.contains(key); }

  double number() const {
    expect(json_.is_number(), "a number");
    return json_.get<double>();
  }
  std::size_t count() const {
    expect(json_.is_number_unsigned(), "a whole number, not negative");
    return json_.get<std::size_t>();
  }
  bool boolean() const {
    expect(json_.is_boolean(), "true or false");
    return json_.get<bool>();
  }
  std::string text() const {
    expect(json_.is_string(), "a text");
    return json_.get<std::string>();
  }
  std::vector<JsonReader> list(std::size_t max_size) const {
    expect(json_.is_array() && json_.size() <= max_size,
           fmt::format("a list of at most {}", max_size));
    std::vector<JsonReader> items;
    for (std::size_t i = 0; i < json_.size(); ++i) {
      items.emplace_back(json_.at(i), where_, fmt::format("{}[{}]", path_, i));
    }
    return items;
  }
  std::vector<double> numbers(std::size_t max_size) const {
    std::vector<double> values;
    for (const JsonReader& item : list(max_size)) values.push_back(item.number());
    return values;
  }
  template <typename Matrix>
  void matrix(Matrix& out) const {
    const std::vector<JsonReader> rows = list(Matrix::MaxRowsAtCompileTime);
    expect(!rows.empty(), "at least one row");
    const std::size_t columns = rows[0].list(Matrix::MaxColsAtCompileTime).size();
    out.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::vector<double> row = rows[i].numbers(Matrix::MaxColsAtCompileTime);
      rows[i].expect(row.size() == columns, fmt::format("{} numbers in each row", columns));
      for (std::size_t j = 0; j < columns; ++j) out(i, j) = row[j];
    }
  }
  void expect(bool ok, const std::string& accepted) const {
    if (ok) return;
    std::string found = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (found.size() > 60) found = found.substr(0, 57) + "...";
    throw Error(ErrorParts{.where = where_, .key = path_, .found = found, .accepted = accepted});
  }

 private:
  const Json& json_;
  std::string where_;
  std::string path_;
};

}  // namespace photocoag
