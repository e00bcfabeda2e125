#include "photocoag/page/html.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace photocoag {
namespace {

// Tags followed by a line break, since the file is also read and compared as text.
bool ends_a_line(std::string_view tag) {
  constexpr std::array<std::string_view, 18> kBlocks = {
      "p",  "div", "section", "table", "thead", "tbody",  "tr",      "ul",     "li",
      "dl", "h1",  "h2",      "h3",    "pre",   "figure", "details", "header", "footer"};
  return std::find(kBlocks.begin(), kBlocks.end(), tag) != kBlocks.end();
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      case '\r':
        break;
      default: {
        const auto byte = static_cast<unsigned char>(c);
        const bool control = (byte < 0x20 && c != '\n' && c != '\t') || byte == 0x7f;
        if (control) {
          safe += "\xEF\xBF\xBD";
        } else {
          safe += c;
        }
      }
    }
  }
  return safe;
}

Html Html::raw(std::string markup) {
  Html html;
  html.markup_ = std::move(markup);
  return html;
}

Html& Html::operator+=(const Html& more) {
  markup_ += more.markup_;
  return *this;
}

Html element(std::string_view selector, const Html& content,
             std::initializer_list<Attribute> attributes) {
  const std::string tag(selector.substr(0, selector.find('.')));
  std::string markup = "<" + tag;
  if (tag.size() < selector.size()) {
    std::string classes(selector.substr(tag.size() + 1));
    std::replace(classes.begin(), classes.end(), '.', ' ');
    markup += " class=\"" + classes + '"';
  }
  for (const Attribute& attribute : attributes) {
    markup += ' ';
    markup += attribute.name;
    if (!attribute.value.empty()) markup += "=\"" + escape_html(attribute.value) + '"';
  }
  markup += ">" + content.str() + "</" + tag + ">";
  if (ends_a_line(tag)) markup += '\n';
  return Html::raw(std::move(markup));
}

Html element(std::string_view selector, std::initializer_list<Html> contents,
             std::initializer_list<Attribute> attributes) {
  Html all;
  for (const Html& content : contents) all += content;
  return element(selector, all, attributes);
}

}  // namespace photocoag
