// Role: offline; HTML that is safe by default: text is always escaped except by Html::raw. Used by
// page, report, study, campaign. Real-time promise: none. Threads: none.
#pragma once

#include <concepts>
#include <initializer_list>
#include <string>
#include <string_view>

namespace photocoag {

/// `text` with & < > " ' as entities; control characters other than tab and line feed as U+FFFD.
std::string escape_html(std::string_view text);

/// A piece of HTML.
class Html {
 public:
  Html() = default;
  /// Text: it is escaped.
  template <std::convertible_to<std::string_view> Text>
  Html(const Text& text) : markup_(escape_html(text)) {}
  /// Trusted markup, e.g. the program's own drawing or style.
  static Html raw(std::string markup);

  Html& operator+=(const Html& more);
  friend Html operator+(Html first, const Html& second) { return first += second; }
  bool empty() const noexcept { return markup_.empty(); }
  const std::string& str() const noexcept { return markup_; }

 private:
  std::string markup_;
};

/// name="value"; the value is escaped. A name alone: an empty value.
struct Attribute {
  std::string_view name;
  std::string_view value = {};
};

/// <tag class="…" …>content</tag>. `selector`: the tag and its classes, "div.columns.count-2".
Html element(std::string_view selector, const Html& content,
             std::initializer_list<Attribute> attributes = {});
/// The contents one after the other: element("tr", {element("td", a), element("td", b)}).
Html element(std::string_view selector, std::initializer_list<Html> contents,
             std::initializer_list<Attribute> attributes = {});

}  // namespace photocoag
