// The colours of the inks. Hues after Okabe & Ito, darkened for a light page and
// lightened for a dark one until lines reach a contrast of 3:1 and text 4.5:1.
#include <fmt/format.h>

#include <array>

#include "photocoag/page/layout.hpp"

namespace photocoag {
namespace figure_detail {
namespace {

struct Colour {
  std::string_view name, light, dark;
};

// Grid, axes and tick labels, then the inks in the order of their enum.
constexpr std::array<Colour, 12> kColours = {{
    {"grid", "#e3e6e9", "#2b3138"},
    {"axis", "#7b858f", "#7f8a95"},
    {"tick", "#4a545e", "#aab4be"},
    {"series-1", "#0072b2", "#56b4e9"},
    {"series-2", "#b86200", "#f0a93c"},
    {"series-3", "#00805c", "#2fc79a"},
    {"series-4", "#a2478a", "#e39bc4"},
    {"series-5", "#2e86c1", "#8fd0f5"},
    {"series-6", "#857400", "#e0d040"},
    {"neutral", "#3c4650", "#c3ccd4"},
    {"muted", "#848e98", "#8a949e"},
    {"limit", "#c4001d", "#ff6b70"},
}};
constexpr std::string_view kInkLight = "#1a2026", kInkDark = "#e6eaee";
constexpr std::string_view kPaperLight = "#ffffff", kPaperDark = "#14181c";
constexpr int kFirstInk = 3;

}  // namespace

std::string_view class_of(Ink ink) noexcept {
  return kColours[static_cast<std::size_t>(kFirstInk + static_cast<int>(ink))].name;
}

namespace {

using Out = std::back_insert_iterator<std::string>;

// Values of all colours, as custom properties.
std::string properties(bool dark) {
  std::string css;
  for (const Colour& colour : kColours)
    fmt::format_to(Out(css), "--{}:{};", colour.name, dark ? colour.dark : colour.light);
  fmt::format_to(Out(css), "--ink:{};--paper:{};", dark ? kInkDark : kInkLight,
                 dark ? kPaperDark : kPaperLight);
  return css;
}

// The classes; `value` gives the text for a colour: var(--limit) or the colour itself.
template <class Value>
std::string classes(const Value& value) {
  std::string css;
  for (const Colour& colour : kColours) {
    const std::string text = value(colour.name, colour.light, colour.dark);
    fmt::format_to(Out(css), ".pc-line-{0}{{stroke:{1}}}.pc-area-{0}{{fill:{1};fill-opacity:.22}}",
                   colour.name, text);
    fmt::format_to(Out(css), ".pc-text-{0},.pc-area-text-{0}{{fill:{1}}}\n", colour.name, text);
  }
  fmt::format_to(Out(css), ".pc-text-title,.pc-text-legend{{fill:{}}}\n",
                 value("ink", kInkLight, kInkDark));
  const std::string paper = value("paper", kPaperLight, kPaperDark);
  fmt::format_to(Out(css), ".pc-text-level{{stroke:{0}}}.pc-paper{{fill:{0}}}\n", paper);
  return css;
}

constexpr std::string_view kShapes =
    ".pc-figure{display:block;height:auto}\n"
    ".pc-figure text{font-family:system-ui,-apple-system,\"Segoe UI\",Roboto,\"Noto Sans\","
    "\"Liberation Sans\",Arial,sans-serif;font-size:12px;font-variant-numeric:tabular-nums}\n"
    ".pc-figure .pc-text-title{font-size:13px;font-weight:600}\n"
    ".pc-figure .pc-text-level{font-weight:600;paint-order:stroke;stroke-width:3.5px;"
    "stroke-linejoin:round}\n";

}  // namespace
}  // namespace figure_detail

std::string figure_css(SvgKind kind) {
  using namespace figure_detail;
  if (kind == SvgKind::kInline) {
    const auto variable = [](std::string_view name, std::string_view, std::string_view) {
      return fmt::format("var(--{})", name);
    };
    return fmt::format(
        ":root{{{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n{}{}",
        properties(false), properties(true), kShapes, classes(variable));
  }
  const auto light = [](std::string_view, std::string_view value, std::string_view) {
    return std::string(value);
  };
  const auto dark = [](std::string_view, std::string_view, std::string_view value) {
    return std::string(value);
  };
  return fmt::format("{}{}@media screen and (prefers-color-scheme:dark){{\n{}}}\n", kShapes,
                     classes(light), classes(dark));
}

}  // namespace photocoag
