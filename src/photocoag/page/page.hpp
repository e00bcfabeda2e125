// Role: offline; what all pages share: head, style, script, tables, tiles, figures. Used by report,
// study, campaign. A page is one file without an asset from outside; its policy lets no other
// script run than script.cpp's. The same content gives the same bytes. Real-time promise: none.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "photocoag/page/figure.hpp"
#include "photocoag/page/html.hpp"

namespace photocoag {

/// The top of a page, from the small line above the headline downwards.
struct PageHead {
  std::string title = {};   ///< of the window; "photocoag" follows
  std::string kicker = {};  ///< small, after program and version
  Html headline = {};       ///< empty: the title
  Html line = {};
  std::string notice = {};    ///< after the research notice
  std::string_view css = {};  ///< of this page alone
};

/// The whole file. Throws nothing but what memory does.
std::string page(const PageHead& head, const Html& body);

/// A section with its heading.
Html section(std::string_view heading, const Html& content);

/// A number that one asks for first, for tiles(); its name, and words about it.
struct Tile {
  std::string name = {}, value = {}, note = {};
};
Html tiles(const std::vector<Tile>& all);

/// A table before it is HTML or something else. A line feed in a head breaks the line.
struct Table {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;  ///< the first cell names its row
};
/// In a frame that scrolls sideways. `name`: what it holds, for people who cannot see it.
Html table(const Table& table, std::string_view name);
/// Any other table, framed alike.
Html scroll(const Html& table, std::string_view name);

/// Text with a heading that unfolds it; `words` keep their lines.
Html unfold(const Html& heading, std::string_view words);

/// Drawn for wide and for narrow pages, with its data for the script. Throws as figure_svg.
Html figure_element(const Figure& figure);
/// Two drawings made elsewhere.
Html figure_element(const std::string& wide, const std::string& narrow);
/// Side by side where there is room.
Html stack(const std::vector<Figure>& figures);

/// The narrow form of a figure: it fits a phone with text of the same size.
Figure narrow(Figure figure);

/// The unit in the name of a measure: "K" of "peak_max_K"; empty if there is none.
std::string unit_of(std::string_view measure);

/// Four digits and the unit; "never" if infinite, "none" if NaN.
std::string number_text(double value, std::string_view unit);

/// The page's style, without the drawings' (figure_css).
std::string_view page_css() noexcept;
/// What lets figures zoom, show values and hide series. Without it they stay as they are drawn.
std::string_view page_script() noexcept;

}  // namespace photocoag
