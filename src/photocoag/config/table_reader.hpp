// Role: setup; reads the keys of a TOML table by name. Used by config, run, study, campaign,
// session. Real time: no.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "photocoag/config/source.hpp"

namespace photocoag {

/// All functions throw Error naming file:line, the key with its path, what was found and what is
/// accepted. An absent key gives `otherwise`, nothing or an empty list. `table` must outlive this.
class TableReader {
 public:
  /// Errors name keys "PATH.KEY"; with an empty `path` KEY alone.
  TableReader(const Value& table, std::string path);
  /// The same; refuses keys other than `keys`.
  TableReader(const Value& table, std::string path, std::initializer_list<std::string_view> keys);

  void only(std::initializer_list<std::string_view> keys) const;
  void rename(std::string path) { path_ = std::move(path); }

  const Value* find(std::string_view key) const { return table_.find(key); }
  const Value& required(std::string_view key) const;
  std::string text(std::string_view key, std::string otherwise = {}) const;
  std::string required_text(std::string_view key) const;
  bool flag(std::string_view key, bool otherwise) const;
  std::string word(std::string_view key, std::initializer_list<std::string_view> words,
                   std::string_view otherwise) const;
  std::optional<double> number(std::string_view key,
                               double low = -std::numeric_limits<double>::max(),
                               double high = std::numeric_limits<double>::max()) const;
  double required_number(std::string_view key) const;
  std::optional<std::uint64_t> count(
      std::string_view key, std::int64_t low,
      std::int64_t high = std::numeric_limits<std::int64_t>::max()) const;
  int integer(std::string_view key, int low, int high, int otherwise) const;
  std::vector<int> integers(std::string_view key) const;
  std::vector<std::string> texts(std::string_view key) const;
  std::vector<double> numbers(std::string_view key) const;
  std::vector<TableReader> tables(std::string_view key) const;

  /// Throws Error for the value of that key.
  [[noreturn]] void refuse(std::string_view key, std::string accepted) const;
  void require(bool good, std::string_view key, std::string accepted) const;

 private:
  std::string full(std::string_view key) const;
  const std::vector<Entry>& items(std::string_view key, const char* accepted) const;
  [[noreturn]] void refuse(const Value& value, std::string_view key, std::string accepted) const;

  const Value& table_;
  std::string path_;
};

}  // namespace photocoag
