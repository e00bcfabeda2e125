// gnuplot's drawing -> our SVG: its paths, areas, dots and tick labels are read and written anew
// with classes instead of colours; everything else (header, ids, definitions, empty groups) is
// dropped.
#include <fmt/format.h>

#include <cctype>
#include <cstdlib>
#include <iterator>

#include "photocoag/core/error.hpp"
#include "photocoag/report/html.hpp"
#include "photocoag/report/plot_layout.hpp"

namespace photocoag::plot_detail {
namespace {

using Out = std::back_insert_iterator<std::string>;

// The value of an attribute of a tag: name = 'value' or name="value". Empty if absent.
std::string_view attribute(std::string_view tag, std::string_view name) {
  for (std::size_t at = tag.find(name); at != std::string_view::npos; at = tag.find(name, at + 1)) {
    const bool starts = at > 0 && std::isspace(static_cast<unsigned char>(tag[at - 1])) != 0;
    std::size_t k = at + name.size();
    while (k < tag.size() && (tag[k] == ' ' || tag[k] == '=')) ++k;
    if (!starts || k == at + name.size() || k >= tag.size()) continue;
    const char quote = tag[k];
    if (quote != '\'' && quote != '"') continue;
    const std::size_t end = tag.find(quote, k + 1);
    if (end != std::string_view::npos) return tag.substr(k + 1, end - k - 1);
  }
  return {};
}

// The class of a placeholder "rgb(250, 1, 17)"; empty for gnuplot's own black, white and gray.
std::string_view class_of_colour(std::string_view colour) {
  if (!colour.starts_with("rgb(")) return {};
  const std::size_t comma = colour.rfind(',');
  const std::string_view name = class_of_placeholder(std::atoi(colour.data() + comma + 1));
  if (name.empty()) throw Error("gnuplot drew in an unexpected colour: " + std::string(colour));
  return name;
}

// "M40.95,237.60 L171.30,175.29" -> "M40.95 237.6L171.3 175.29": shorter, the same numbers.
std::string compact(std::string_view path) {
  std::string text;
  for (std::size_t k = 0; k < path.size();) {
    const char c = path[k];
    if (c == '-' || c == '.' || (c >= '0' && c <= '9')) {
      std::size_t end = path.find_first_not_of("-.0123456789", k);
      if (end == std::string_view::npos) end = path.size();
      std::string_view number = path.substr(k, end - k);
      if (number.find('.') != std::string_view::npos) {
        while (number.ends_with('0')) number.remove_suffix(1);
        if (number.ends_with('.')) number.remove_suffix(1);
      }
      if (!text.empty() && std::isalpha(static_cast<unsigned char>(text.back())) == 0) text += ' ';
      text += number;
      k = end;
    } else {
      if (std::isalpha(static_cast<unsigned char>(c)) != 0) text += c;
      ++k;
    }
  }
  return text;
}

// "translate(x,y) …" -> "x,y"
std::string_view translation(std::string_view transform) {
  const std::size_t open = transform.find('(');
  const std::size_t close = transform.find(')');
  if (open == std::string_view::npos || close == std::string_view::npos) return "0,0";
  return transform.substr(open + 1, close - open - 1);
}

class Rewriter {
 public:
  explicit Rewriter(const Figure& figure) : figure_(figure) {}

  std::string backdrop;  ///< grid, axes, tick labels
  std::string curves;    ///< bands, lines, dots: drawn above the level names, which hide no data

  void run(std::string_view drawn) {
    std::size_t at = drawn.find("</defs>");
    while (at != std::string_view::npos && (at = drawn.find('<', at)) != std::string_view::npos) {
      const std::size_t end = drawn.find('>', at);
      if (end == std::string_view::npos) break;
      take(drawn.substr(at + 1, end - at - 1), drawn.substr(end + 1));
      at = end;
    }
    flush_dots();
  }

 private:
  void take(std::string_view tag, std::string_view rest) {
    const std::string_view name = tag.substr(0, tag.find_first_of(" \t\n/"));
    if (name != "use") flush_dots();
    if (name == "g") {
      if (const auto width = attribute(tag, "stroke-width"); !width.empty()) width_ = width;
      if (attribute(tag, "text-anchor").empty()) return;
      anchor_ = attribute(tag, "text-anchor");
      place_ = translation(attribute(tag, "transform"));
      text_class_ = class_of_colour(attribute(tag, "fill"));
    } else if (name == "path") {
      path(tag);
    } else if (name == "polygon") {
      fmt::format_to(Out(curves), "<polygon class=\"pc-area-{}\" points=\"{}\"/>\n",
                     class_of_colour(attribute(tag, "fill")), compact(attribute(tag, "points")));
    } else if (name == "use") {
      dots_class_ = class_of_colour(attribute(tag, "color"));
      dots_ += 'M' + compact(translation(attribute(tag, "transform"))) + "h0";
    } else if (name == "text") {
      const std::size_t comma = place_.find(',');
      fmt::format_to(Out(backdrop),
                     "<text class=\"pc-text-{}\" x=\"{}\" y=\"{}\" text-anchor=\"{}\">{}</text>\n",
                     text_class_, compact(place_.substr(0, comma)),
                     compact(place_.substr(comma + 1)), anchor_,
                     escape_html(rest.substr(0, rest.find('<'))));
    }
  }

  void path(std::string_view tag) {
    const std::string_view colour = class_of_colour(attribute(tag, "stroke"));
    if (colour.empty()) return;
    const std::string_view dash = attribute(tag, "stroke-dasharray");
    std::string& layer = colour == "grid" || colour == "axis" ? backdrop : curves;
    fmt::format_to(Out(layer), "<path class=\"pc-line-{}\" stroke-width=\"{}\"", colour,
                   compact(width_));
    if (!dash.empty()) fmt::format_to(Out(layer), " stroke-dasharray=\"{}\"", dash);
    fmt::format_to(Out(layer), " d=\"{}\"/>\n", compact(attribute(tag, "d")));
  }

  // All dots of a series as one path of strokes without length and with round ends.
  void flush_dots() {
    if (dots_.empty()) return;
    double diameter = 2.0;
    for (const Panel& panel : figure_.panels)
      for (const Series& series : panel.series)
        if (series.mark == Mark::kPoints && class_of(series.ink) == dots_class_)
          diameter = series.width;
    fmt::format_to(
        Out(curves),
        "<path class=\"pc-line-{}\" stroke-width=\"{}\" stroke-linecap=\"round\" d=\"{}\"/>\n",
        dots_class_, diameter, dots_);
    dots_.clear();
  }

  const Figure& figure_;
  std::string_view width_ = "1", anchor_ = "start", place_ = "0,0", text_class_, dots_class_;
  std::string dots_;
};

void write_legend(std::string& svg, const PanelLayout& place) {
  for (const LegendEntry& entry : place.legend) {
    const double sample = entry.dot ? 6.0 : kSampleLength;
    const double middle = entry.y - 4.0;
    const std::string_view ink = class_of(entry.ink);
    if (entry.area) {
      fmt::format_to(Out(svg),
                     "<rect class=\"pc-area-{}\" x=\"{:.2f}\" y=\"{:.2f}\" width=\"{}\" "
                     "height=\"10\"/>\n",
                     ink, entry.x, middle - 5.0, sample);
    } else if (entry.dot) {
      fmt::format_to(Out(svg),
                     "<path class=\"pc-line-{}\" stroke-width=\"{}\" stroke-linecap=\"round\" "
                     "d=\"M{:.2f} {:.2f}h0\"/>\n",
                     ink, entry.width + 1.0, entry.x + 3.0, middle);
    } else {
      fmt::format_to(Out(svg), "<path class=\"pc-line-{}\" stroke-width=\"{}\"", ink, entry.width);
      if (entry.dash != Dash::kSolid)
        fmt::format_to(Out(svg), " stroke-dasharray=\"{}\"", dash_pattern(entry.dash));
      fmt::format_to(Out(svg), " d=\"M{:.2f} {:.2f}h{}\"/>\n", entry.x, middle, sample);
    }
    fmt::format_to(Out(svg), "<text class=\"pc-text-legend\" x=\"{:.2f}\" y=\"{:.2f}\">{}</text>\n",
                   entry.x + sample + 6.0, entry.y, escape_html(entry.text));
  }
}

void write_words(std::string& svg, const Panel& panel, const PanelLayout& place) {
  fmt::format_to(Out(svg), "<text class=\"pc-text-title\" x=\"2\" y=\"{:.2f}\">{}</text>\n",
                 place.title_y, escape_html(panel.title));
  write_legend(svg, place);
}

// The names of the levels, at their right ends.
void write_levels(std::string& svg, const Panel& panel, const PanelLayout& place) {
  for (const Level& level : panel.levels) {
    if (level.label.empty() || level.y < place.y_min || level.y > place.y_max) continue;
    const double line = place.height_of(level.y);
    fmt::format_to(Out(svg),
                   "<text class=\"pc-text-level pc-area-text-{}\" x=\"{:.2f}\" y=\"{:.2f}\" "
                   "text-anchor=\"end\">{}</text>\n",
                   class_of(level.ink), place.right - 2.0, line + (level.label_below ? 13.0 : -4.0),
                   escape_html(level.label));
  }
}

}  // namespace

std::string rewrite_svg(std::string_view drawn, const Figure& figure, const FigureLayout& layout,
                        SvgKind kind) {
  const bool alone = kind == SvgKind::kStandAlone;
  std::string svg;
  if (alone) svg += "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  svg += "<svg class=\"pc-figure\"";
  if (alone) svg += " xmlns=\"http://www.w3.org/2000/svg\"";
  fmt::format_to(Out(svg),
                 " viewBox=\"0 0 {} {}\" width=\"100%\" role=\"img\" aria-label=\"{}\">\n",
                 layout.width, layout.height, escape_html(figure.description));
  if (alone) {
    svg += "<style>\n" + plot_css(kind) + "</style>\n";
    svg += "<rect class=\"pc-paper\" width=\"100%\" height=\"100%\"/>\n";
  }
  Rewriter rewriter(figure);
  rewriter.run(drawn);
  const std::string_view group = "<g fill=\"none\" stroke-linejoin=\"round\">\n";
  fmt::format_to(Out(svg), "{}{}</g>\n", group, rewriter.backdrop);
  for (std::size_t k = 0; k < figure.panels.size(); ++k)
    write_levels(svg, figure.panels[k], layout.panels[k]);
  fmt::format_to(Out(svg), "{}{}</g>\n", group, rewriter.curves);
  for (std::size_t k = 0; k < figure.panels.size(); ++k)
    write_words(svg, figure.panels[k], layout.panels[k]);
  fmt::format_to(
      Out(svg),
      "<text class=\"pc-text-tick\" x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"end\">{}</text>\n",
      layout.panels.back().right, layout.height - 8.0, escape_html(figure.x_label));
  svg += "</svg>\n";
  return svg;
}

}  // namespace photocoag::plot_detail
