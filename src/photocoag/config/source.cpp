#include "photocoag/config/source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

// Only here: it is a large header.
#include <toml++/toml.h>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kMostBytes = 1'000'000;

constexpr int kDeepest = 8;  // deeper than any key we know: what lies below is unknown anyway
constexpr std::ptrdiff_t kMostDots = 64;

// A text and its name; finds the spelling of a value from its line and column.
struct Text {
  Text(std::string_view content, std::string text_name, bool is_file)
      : name(std::move(text_name)), has_lines(is_file) {
    while (!content.empty()) {
      std::string_view line = content.substr(0, content.find('\n'));
      content.remove_prefix(std::min(line.size() + 1, content.size()));
      if (line.ends_with('\r')) line.remove_suffix(1);
      lines.push_back(line);
    }
  }

  std::string where(const toml::source_position& position) const {
    return has_lines ? fmt::format("{}:{}", name, position.line) : name;
  }
  std::string_view line(std::size_t number) const {
    return number >= 1 && number <= lines.size() ? lines[number - 1] : std::string_view();
  }
  std::string_view spelling(const toml::source_position& position) const;

  std::string name;  // the file, or "--set key=value"
  bool has_lines;    // a file
  std::vector<std::string_view> lines;
};

// A number, date or boolean: up to whatever may follow a value. Columns count code points.
std::string_view Text::spelling(const toml::source_position& position) const {
  std::string_view rest = line(position.line);
  for (std::size_t column = 1; column < position.column && !rest.empty(); ++column) {
    do rest.remove_prefix(1);
    while (!rest.empty() && (static_cast<unsigned char>(rest.front()) & 0xC0U) == 0x80U);
  }
  return rest.substr(0, rest.find_first_of(" \t,]}#"));
}

Value::Kind kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::integer:
      return Value::Kind::kInteger;
    case toml::node_type::floating_point:
      return Value::Kind::kFloat;
    case toml::node_type::boolean:
      return Value::Kind::kBoolean;
    case toml::node_type::string:
      return Value::Kind::kString;
    case toml::node_type::array:
      return Value::Kind::kArray;
    case toml::node_type::table:
      return Value::Kind::kTable;
    default:
      return Value::Kind::kDate;
  }
}

Value convert(const toml::node& node, const Text& text, int depth);

void convert_table(const toml::table& table, const Text& text, int depth, Value& value) {
  std::vector<std::pair<const toml::key*, const toml::node*>> sorted;
  for (auto&& [key, node] : table) sorted.emplace_back(&key, &node);
  const auto place = [](const auto& entry) {
    const toml::source_position begin = entry.first->source().begin;
    return std::pair(begin.line, begin.column);
  };
  std::sort(sorted.begin(), sorted.end(),
            [&](const auto& a, const auto& b) { return place(a) < place(b); });
  for (const auto& [key, node] : sorted) {
    value.entries.push_back({std::string(key->str()), convert(*node, text, depth + 1)});
  }
}

Value convert(const toml::node& node, const Text& text, int depth) {
  Value value;
  value.kind = kind_of(node);
  value.where = text.where(node.source().begin);
  if (const auto* table = node.as_table()) {
    value.text = "{…}";
    if (depth < kDeepest) convert_table(*table, text, depth, value);
  } else if (const auto* array = node.as_array()) {
    value.text = "[…]";
    for (const toml::node& element : *array) {
      if (depth < kDeepest) value.entries.push_back({"", convert(element, text, depth + 1)});
    }
  } else if (const auto* string = node.as_string()) {
    value.string = string->get();
    value.text = shown(toml_quoted(value.string));
  } else {
    if (const auto* integer = node.as_integer()) value.integer = integer->get();
    if (const auto* number = node.as_floating_point()) value.number = number->get();
    value.text = text.spelling(node.source().begin);
  }
  return value;
}

// The library limits nested values, but not dotted keys (a.b.c.d…), which nest as well: a hundred
// thousand levels overflow the stack when freed.
void refuse_deep_keys(const Text& text) {
  for (std::size_t number = 1; number <= text.lines.size(); ++number) {
    const std::string_view line = text.line(number);
    if (std::count(line.begin(), line.end(), '.') <= kMostDots) continue;
    throw Error({.where = text.has_lines ? fmt::format("{}:{}", text.name, number) : text.name,
                 .problem = "too many dots in a line",
                 .accepted = fmt::format("at most {}", kMostDots)});
  }
}

std::string ascii(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c < ' ' || c > '~') c = c == '\t' ? ' ' : '?';
  }
  return shown(result);
}

// Throws Error for a file and toml::parse_error for an option (which may be a bare string).
Value parse(std::string_view content, const std::string& name, bool is_file) {
  const Text text(content, name, is_file);
  refuse_deep_keys(text);
  if (!is_file) return convert(toml::parse(content), text, 0);
  try {
    return convert(toml::parse(content), text, 0);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    const std::string line = ascii(text.line(at.line));
    throw Error({.where = fmt::format("{}:{}:{}", text.name, at.line, at.column),
                 .problem = "not TOML: " + shown(error.description(), 200),
                 .found = line.empty() ? std::string() : "the line `" + line + "`"});
  }
}

// The one entry of the root table that `text` is expected to make.
std::optional<Entry> parse_one(const std::string& text, const std::string& name) {
  try {
    Value root = parse(text, name, false);
    if (root.entries.size() != 1) return std::nullopt;
    return std::move(root.entries.front());
  } catch (const toml::parse_error&) {
    return std::nullopt;
  }
}

Value override_value(std::string_view written, const std::string& name) {
  while (written.starts_with(' ')) written.remove_prefix(1);
  while (written.ends_with(' ')) written.remove_suffix(1);
  const std::string as_toml = fmt::format("value = {}", written);
  if (auto entry = parse_one(as_toml, name)) return std::move(entry->value);
  const std::string as_string = fmt::format("value = {}", toml_quoted(written));
  if (auto entry = parse_one(as_string, name)) return std::move(entry->value);
  throw Error({.where = name,
               .problem = "the value is neither TOML nor text",
               .accepted = "a TOML value, or text in UTF-8"});
}

}  // namespace

const Value* Value::find(std::string_view key) const {
  for (const Entry& entry : entries) {
    if (entry.key == key) return &entry.value;
  }
  return nullptr;
}

std::string_view kind_name(Value::Kind kind) noexcept {
  constexpr std::string_view names[] = {"an integer",     "a number", "a boolean", "a string",
                                        "a date or time", "an array", "a table"};
  return names[static_cast<std::size_t>(kind)];
}

Value read_toml_file(const std::string& file) {
  return parse(plain_text(read_file(file, kMostBytes, "TOML file"), file), file, true);
}

Value read_toml_text(std::string_view text, const std::string& name) {
  if (text.size() > kMostBytes) {
    throw Error({.where = name,
                 .problem = "too long",
                 .found = fmt::format("{} bytes", text.size()),
                 .accepted = fmt::format("at most {} bytes", kMostBytes)});
  }
  return parse(plain_text(std::string(text), name), name, true);
}

Value read_override(const std::string& option) {
  const std::string name = "--set " + shown(option);
  const std::size_t equals = option.find('=');
  const bool has_control = std::any_of(option.begin(), option.end(),
                                       [](char c) { return static_cast<unsigned char>(c) < ' '; });
  if (equals == std::string::npos || has_control) {
    throw Error({.where = name, .accepted = "key=value in one line, e.g. control.period_ms=2"});
  }
  const std::string key_text = option.substr(0, equals) + " = 0";
  const auto keys = parse_one(key_text, name);
  if (!keys) {
    throw Error({.where = name,
                 .problem = "no key before the equals sign",
                 .found = toml_quoted(shown(option.substr(0, equals))),
                 .accepted = "key=value, e.g. control.period_ms=2"});
  }
  Value root;
  root.where = name;
  Value* inner = &root;
  for (const Entry* key = &*keys; key != nullptr;) {
    inner->entries.push_back({key->key, Value()});
    inner = &inner->entries.back().value;
    inner->where = name;
    inner->text = "{…}";
    key = key->value.entries.empty() ? nullptr : &key->value.entries.front();
  }
  *inner = override_value(option.substr(equals + 1), name);
  return root;
}

std::string shown(std::string_view text, std::size_t most) {
  std::string result(text.substr(0, most));
  if (text.size() > most) {
    while (!result.empty() && (static_cast<unsigned char>(text[result.size()]) & 0xC0U) == 0x80U) {
      result.pop_back();
    }
    result += "…";
  }
  for (char& c : result) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7F') c = '?';
  }
  return result;
}

std::string toml_quoted(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (static_cast<unsigned char>(c) < ' ' || c == '\x7F') {
      result += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
    } else {
      result += c;
    }
  }
  return result + "\"";
}

}  // namespace photocoag
