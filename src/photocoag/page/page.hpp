// Role: offline; common parts of all pages: head, style, script, tables, tiles, figures. Used by
// report, study, campaign, session. A page is one self-contained file; its content security policy
// allows only the script of script.cpp. The same content gives the same bytes. Real-time promise:
// none.
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
  std::string notice = {};    ///< text after the research notice
  std::string_view css = {};  ///< additional style of this page
};

/// The whole file. Throws only std::bad_alloc.
std::string page(const PageHead& head, const Html& body);

/// A section with its heading.
Html section(std::string_view heading, const Html& content);

/// A key number for tiles(), with its name and a note.
struct Tile {
  std::string name = {}, value = {}, note = {};
};
Html tiles(const std::vector<Tile>& all);

/// A table independent of its format. A line feed in a heading breaks the line.
struct Table {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;  ///< the first cell names its row
};
/// In a frame that scrolls sideways. `name`: label for screen readers.
Html table(const Table& table, std::string_view name);
/// The same frame around any other table.
Html scroll(const Html& table, std::string_view name);

/// Text that unfolds below a heading; `words` keeps its line breaks.
Html unfold(const Html& heading, std::string_view words);

/// Drawn for wide and for narrow pages, with its data for the script. Throws as figure_svg.
Html figure_element(const Figure& figure);
/// The same for two given drawings.
Html figure_element(const std::string& wide, const std::string& narrow);
/// Side by side where there is room.
Html stack(const std::vector<Figure>& figures);

/// The narrow form of a figure, for phones, with text of the same size.
Figure narrow(Figure figure);

/// The unit in the name of a measure: "K" of "peak_max_K"; empty if there is none.
std::string unit_of(std::string_view measure);

/// Four digits and the unit; "never" if infinite, "none" if NaN.
std::string number_text(double value, std::string_view unit);

/// The page's style, without the drawings' (figure_css).
std::string_view page_css() noexcept;
/// Script for zooming, reading values and hiding series. Without it figures are static.
std::string_view page_script() noexcept;

}  // namespace photocoag
