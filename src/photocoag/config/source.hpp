// Role: setup; where configuration values come from: a TOML file and the --set options, as plain
// trees that remember their place. The only user of the TOML library. Used by config, campaign,
// session, study, run, python.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace photocoag {

struct Entry;

/// A TOML value and the place where it was written.
struct Value {
  enum class Kind { kInteger, kFloat, kBoolean, kString, kDate, kArray, kTable };

  Kind kind = Kind::kTable;
  std::string where;  ///< "file:line", or "--set key=value"
  std::string text;   ///< as written (a string: in quotes; an array or table: "[…]" or "{…}")
  std::int64_t integer = 0;    ///< if kInteger
  double number = 0.0;         ///< if kFloat; `text` is exact
  std::string string;          ///< if kString: valid UTF-8
  std::vector<Entry> entries;  ///< if kTable: in the order of the text; if kArray: without keys

  /// The entry of that key, or nullptr.
  const Value* find(std::string_view key) const;
};

struct Entry {
  std::string key;
  Value value;
};

/// "a string", "an integer", …
std::string_view kind_name(Value::Kind kind) noexcept;

/// Reads a TOML file: regular, at most 1 MB, UTF-8 (one byte order mark is skipped).
/// Throws Error with file:line:column and the parser's message.
Value read_toml_file(const std::string& file);

/// The same for a text in memory; `name` stands for the file. Throws Error.
Value read_toml_text(std::string_view text, const std::string& name);

/// Reads "key=value"; the value is TOML, else a bare string. Throws Error naming the option.
Value read_override(const std::string& option);

/// For messages: without control characters, cut to `most` bytes.
std::string shown(std::string_view text, std::size_t most = 80);

/// `text` as a TOML basic string, with its quotes.
std::string toml_quoted(std::string_view text);

}  // namespace photocoag
