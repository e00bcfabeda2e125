#include "photocoag/study/page_frame.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "photocoag/core/build_info.hpp"
#include "photocoag/report/html.hpp"
#include "photocoag/report/page.hpp"
#include "photocoag/report/plot.hpp"

namespace photocoag {

std::string page_begin(std::string_view title, std::string_view kicker, std::string_view line,
                       std::string_view notice, std::string_view css) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'\">\n<title>{0} – photocoag</title>\n<style>\n{1}{2}{3}</style>\n</head>\n"
      "<body>\n<main>\n<header>\n<p class=\"kicker\">photocoag {4} · {5}</p>\n"
      "<h1><span class=\"verdict\">{0}</span></h1>\n<p class=\"run\">{6}</p>\n"
      "<p class=\"notice\">{7} {8}</p>\n</header>\n",
      escape_html(title), plot_css(SvgKind::kInline), page_css(), css, version(),
      escape_html(kicker), escape_html(line), kResearchNotice, escape_html(notice));
}

std::string page_end() {
  return fmt::format("<footer><p>{}</p></footer>\n</main>\n</body>\n</html>\n", kResearchNotice);
}

std::string page_tile(std::string_view name, std::string_view value, std::string_view note) {
  return fmt::format("<div><dt>{}</dt><dd>{}<small>{}</small></dd></div>\n", escape_html(name),
                     escape_html(value), escape_html(note));
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
