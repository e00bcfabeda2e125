#include "photocoag/page/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "photocoag/core/base64.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/sha256.hpp"

namespace photocoag {
namespace {

// A script's hash in a content security policy: SHA-256 in base64.
std::string policy_hash(std::string_view script) {
  const std::string digits = sha256_hex(script);
  std::vector<unsigned char> bytes;
  for (std::size_t k = 0; k < digits.size(); k += 2)
    bytes.push_back(static_cast<unsigned char>(std::stoi(digits.substr(k, 2), nullptr, 16)));
  return base64(bytes);
}

Html head_element(const PageHead& head) {
  return Html::raw(fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'sha256-{}'\">\n<title>{}</title>\n<style>\n{}{}{}</style>\n"
      "</head>\n<body>\n",
      policy_hash(page_script()), escape_html(head.title + " – photocoag"),
      figure_css(SvgKind::kInline), page_css(), head.css));
}

}  // namespace

std::string page(const PageHead& head, const Html& body) {
  const Html headline = head.headline.empty() ? Html(head.title) : head.headline;
  Html notice(kResearchNotice);
  if (!head.notice.empty()) notice += " " + head.notice;
  return (head_element(head) +
          element("main",
                  {element("header", {element("p.kicker", fmt::format("photocoag {} · {}",
                                                                      version(), head.kicker)),
                                      element("h1", headline), element("p.run", head.line),
                                      element("p.notice", notice)}),
                   body, element("footer", element("p", kResearchNotice))}) +
          Html::raw(fmt::format("<script>{}</script>\n</body>\n</html>\n", page_script())))
      .str();
}

Html section(std::string_view heading, const Html& content) {
  return element("section", {element("h2", heading), content});
}

Html tiles(const std::vector<Tile>& all) {
  Html list;
  for (const Tile& tile : all)
    list += element("div", {element("dt", tile.name),
                            element("dd", {tile.value, element("small", tile.note)})});
  return element("dl.tiles", list);
}

Html scroll(const Html& table, std::string_view name) {
  return element("div.scroll", table,
                 {{"role", "region"}, {"tabindex", "0"}, {"aria-label", name}});
}

Html table(const Table& table, std::string_view name) {
  Html head, body;
  for (const std::string& cell : table.head) head += element("th", cell, {{"scope", "col"}});
  for (const auto& row : table.rows) {
    Html cells;
    for (const std::string& cell : row)
      cells += cells.empty() ? element("th", cell, {{"scope", "row"}}) : element("td", cell);
    body += element("tr", cells);
  }
  return scroll(
      element("table.data", {element("thead", element("tr", head)), element("tbody", body)}), name);
}

Html unfold(const Html& heading, std::string_view words) {
  return element("details", {element("summary", heading),
                             element("pre.config", element("code", words), {{"tabindex", "0"}})});
}

Figure narrow(Figure figure) {
  figure.width = 310.0;
  figure.panel_height = std::min(figure.panel_height, 228.0);
  figure.max_points = std::min<std::size_t>(figure.max_points, 1000);
  return figure;
}

Html figure_element(const std::string& wide, const std::string& narrow) {
  return element("figure",
                 {element("div.wide", Html::raw(wide)), element("div.narrow", Html::raw(narrow))});
}

Html figure_element(const Figure& figure) {
  return figure_element(figure_svg(figure, SvgKind::kInline),
                        figure_svg(narrow(figure), SvgKind::kPicture));
}

Html stack(const std::vector<Figure>& figures) {
  Html all;
  for (const Figure& figure : figures) all += figure_element(figure);
  return element("div.stack", all);
}

std::string unit_of(std::string_view measure) {
  for (const auto& [suffix, unit] :
       {std::pair{"_K", "K"}, {"_ms", "ms"}, {"_mW", "mW"}, {"_us", "µs"}, {"_percent", "%"}}) {
    if (measure.ends_with(suffix)) return unit;
  }
  return {};
}

std::string number_text(double value, std::string_view unit) {
  std::string text = std::isinf(value)   ? "never"
                     : std::isnan(value) ? "none"
                                         : fmt::format("{:.4g}", value);
  if (text.starts_with('-')) text = "−" + text.substr(1);
  return unit.empty() || !std::isfinite(value) ? text : fmt::format("{}\u00a0{}", text, unit);
}

}  // namespace photocoag
