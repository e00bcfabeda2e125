// Draws a figure. The page's script (script.cpp) reads its data from data-… attributes: data-view
// of the figure, data-panel, and style and numbers of each curve.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photocoag/page/html.hpp"
#include "photocoag/page/paths.hpp"

namespace photocoag {
namespace figure_detail {
namespace {

using Out = std::back_insert_iterator<std::string>;

void text(std::string& svg, std::string_view style, double x, double y, std::string_view anchor,
          std::string_view words, std::string_view more = {}) {
  fmt::format_to(Out(svg),
                 "<text class=\"{}\" x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"{}\"{}>{}</text>\n",
                 style, x, y, anchor, more, escape_html(words));
}

void stroke(std::string& svg, std::string_view style, double width, std::string_view dash,
            const Path& line, std::string_view more = {}) {
  fmt::format_to(Out(svg), "<path class=\"{}\" stroke-width=\"{:g}\"", style, width);
  if (!dash.empty()) fmt::format_to(Out(svg), " stroke-dasharray=\"{}\"", dash);
  fmt::format_to(Out(svg), " d=\"{}\"{}/>\n", line.text(), more);
}

struct Tick {
  double value;
  std::string label;
};

std::vector<Tick> ticks(double low, double high, const Ticks& how, bool log) {
  std::vector<Tick> marks;
  if (log) {
    for (double value = std::pow(10.0, std::ceil(std::log10(low) - 1e-9));
         value <= high * (1 + 1e-9); value *= how.step) {
      // No room for six digits: 100k.
      const bool many = high >= 1e5 && value >= 1e3;
      marks.push_back({value, many ? fmt::format("{:g}{}", value >= 1e6 ? value / 1e6 : value / 1e3,
                                                 value >= 1e6 ? 'M' : 'k')
                                   : fmt::format("{:g}", value)});
    }
    return marks;
  }
  const double slack = 1e-9 * (high - low);
  for (double k = std::ceil((low - slack) / how.step); k * how.step <= high + slack; ++k)
    marks.push_back({k * how.step, fmt::format("{:.{}f}", k * how.step + 0.0, how.digits)});
  return marks;
}

// The grid, marks and labels of one axis; the script draws them anew when it zooms.
void axis(std::string& svg, const PanelPlace& place, bool up) {
  const Figure& figure = place.figure;
  const PanelLayout& area = place.area;
  Path grid, marks;
  std::string words;
  const auto all = up ? ticks(area.y.min, area.y.max, area.y_ticks, area.y.log)
                      : ticks(figure.x_min, figure.x_max, place.layout.x_ticks, false);
  for (const auto& [value, label] : all) {
    const double at = up ? place.y(value) : place.x(value);
    grid.move(up ? place.left() : at, up ? at : area.top);
    grid.line(up ? place.right() : at, up ? at : area.bottom);
    marks.move(up ? place.left() - 4.5 : at, up ? at : area.bottom);
    marks.line(up ? place.left() : at, up ? at : area.bottom + 4.5);
    std::string shown = label;
    if (label.starts_with('-')) shown.replace(0, 1, !up && figure.mirrored ? "" : "−");
    text(words, "pc-text-tick", up ? place.left() - 8.0 : at, up ? at + 4.0 : area.bottom + 18.0,
         up ? "end" : "middle", shown);
  }
  fmt::format_to(Out(svg), "<g fill=\"none\" data-axis=\"{}\">\n", up ? "y" : "x");
  stroke(svg, "pc-line-grid", 1.0, "", grid);
  stroke(svg, "pc-line-axis", 1.0, "", marks);
  svg += words + "</g>\n";
}

void axes(std::string& svg, const PanelPlace& place) {
  axis(svg, place, false);
  axis(svg, place, true);
  Path border;
  border.move(place.left(), place.area.top);
  border.line(place.left(), place.area.bottom);
  border.line(place.right(), place.area.bottom);
  stroke(svg, "pc-line-axis", 1.0, "", border, " fill=\"none\"");
}

constexpr std::string_view word_of(Mark mark) {
  constexpr std::string_view kWords[] = {"line", "steps", "bars", "dots"};
  return kWords[static_cast<int>(mark)];
}

// Key that links a legend entry to its curves in every panel.
std::string key_of(Ink ink, std::string_view kind, Dash dash) {
  return fmt::format("{} {} {}", class_of(ink), kind == "steps" ? "line" : kind,
                     dash_pattern(dash));
}

// The attributes of a curve for the script. x is written where it changes.
class Data {
 public:
  explicit Data(SvgKind kind) : kind_(kind) {}
  std::string of(std::string_view mark, const std::string& key, std::string_view name,
                 const std::vector<double>& x, const std::vector<double>& y,
                 const std::vector<double>& z = {}) {
    if (kind_ == SvgKind::kStandAlone) return {};
    std::string text =
        fmt::format(" data-m=\"{}\" data-k=\"{}\" data-n=\"{}\"", mark, key, escape_html(name));
    if (kind_ == SvgKind::kPicture) return text;
    if (x != x_) write(text, "x", x);
    x_ = x;
    write(text, "y", y);
    if (!z.empty()) write(text, "z", z);
    return text;
  }

 private:
  static void write(std::string& text, std::string_view name, const std::vector<double>& values) {
    fmt::format_to(Out(text), " data-{}=\"", name);
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (k > 0) text += ' ';
      if (std::isfinite(values[k])) {
        fmt::format_to(Out(text), "{:.6g}", values[k]);
      } else {
        text += 'n';
      }
    }
    text += '"';
  }
  SvgKind kind_;
  std::vector<double> x_;
};

std::string level_data(const Level& level) { return fmt::format(" data-level=\"{}\"", level.y); }

void level_line(std::string& svg, const PanelPlace& place, const Level& level) {
  if (!place.shows(level.y)) return;
  Path line;
  line.move(place.left(), place.y(level.y));
  line.line(place.right(), place.y(level.y));
  stroke(svg, fmt::format("pc-line-{}", class_of(level.ink)), 1.2, dash_pattern(level.dash), line,
         level_data(level));
}

void level_name(std::string& svg, const PanelPlace& place, const Level& level) {
  if (level.label.empty() || !place.shows(level.y)) return;
  text(svg, fmt::format("pc-text-level pc-area-text-{}", class_of(level.ink)), place.right() - 2.0,
       place.y(level.y) + (level.label_below ? 13.0 : -4.0), "end", level.label, level_data(level));
}

// About a point per px.
void draw_contour(std::string& svg, const PanelPlace& place, const Contour& contour) {
  Path path;
  for (const Isoline& line : contour.lines) {
    double last_x = NAN, last_y = NAN;
    for (std::size_t k = 0; k < line.x.size(); ++k) {
      const double x = place.x(line.x[k]), y = place.y(line.y[k]);
      if (std::hypot(x - last_x, y - last_y) < 0.7) continue;
      std::isnan(last_x) ? path.move(x, y) : path.line(x, y);
      last_x = x;
      last_y = y;
    }
    path.close();
  }
  stroke(svg, fmt::format("pc-area-{0} pc-line-{0}", class_of(contour.ink)), 0.8, "", path);
}

// Labels at the bottom of the lines where there is room, the outermost first.
void contour_names(std::string& svg, const PanelPlace& place) {
  double last = NAN;
  for (const Contour& contour : place.panel.contours) {
    double foot_x = 0.0, foot_y = -1.0;
    for (const Isoline& line : contour.lines)
      for (std::size_t k = 0; k < line.x.size(); ++k)
        if (const double y = place.y(line.y[k]); y > foot_y + 1e-6) {
          foot_x = place.x(line.x[k]);
          foot_y = y;
        }
    if (foot_y < 0.0 || foot_y > place.area.bottom - 4.0 || std::abs(last - foot_y) < 15.0)
      continue;
    text(svg, "pc-text-level pc-text-legend", foot_x, foot_y + 4.0, "middle", contour.label);
    last = foot_y;
  }
}

void curves(std::string& svg, const PanelPlace& place, Data& data) {
  const Panel& panel = place.panel;
  for (const Contour& one : panel.contours) draw_contour(svg, place, one);
  for (const Band& whole : panel.bands) {
    if (!has_values(whole.low)) continue;
    const Band band = visible(whole, place.figure);
    const std::string key = key_of(band.ink, "band", Dash::kSolid);
    stroke(svg, fmt::format("pc-area-{}", class_of(band.ink)), 0.0, "", path_of(band, place),
           data.of("band", key, band.legend, band.x, band.low, band.high));
  }
  for (const Level& level : panel.levels) level_line(svg, place, level);
  for (const Series& whole : panel.series) {
    if (!has_values(whole.y)) continue;
    const Series series = visible(whole, place.figure);
    const bool bars = series.mark == Mark::kBars;
    const bool dots = series.mark == Mark::kPoints;
    std::string style = fmt::format("pc-line-{}", class_of(series.ink));
    if (bars) style = fmt::format("pc-area-{} {}", class_of(series.ink), style);
    stroke(svg, style, series.width, dots ? "" : dash_pattern(series.dash), path_of(series, place),
           (dots ? " stroke-linecap=\"round\"" : "") +
               data.of(word_of(series.mark), key_of(series.ink, word_of(series.mark), series.dash),
                       series.legend, series.x, series.y));
  }
}

void legend(std::string& svg, const PanelLayout& area) {
  for (const LegendEntry& entry : area.legend) {
    const double sample = entry.dot ? 6.0 : kSampleLength;
    const double middle = entry.y - 4.0;
    const std::string_view ink = class_of(entry.ink);
    const std::string_view kind = entry.area ? "band" : entry.dot ? "dots" : "line";
    fmt::format_to(Out(svg), "<g data-key=\"{}\">", key_of(entry.ink, kind, entry.dash));
    Path line;
    if (entry.area) {
      fmt::format_to(Out(svg),
                     "<rect class=\"pc-area-{}\" x=\"{:.2f}\" y=\"{:.2f}\" width=\"{}\" "
                     "height=\"10\"/>\n",
                     ink, entry.x, middle - 5.0, sample);
    } else if (entry.dot) {
      line.dot(entry.x + 3.0, middle);
      stroke(svg, fmt::format("pc-line-{}", ink), entry.width + 1.0, "", line,
             " stroke-linecap=\"round\"");
    } else {
      line.move(entry.x, middle);
      line.line(entry.x + sample, middle);
      stroke(svg, fmt::format("pc-line-{}", ink), entry.width, dash_pattern(entry.dash), line);
    }
    text(svg, "pc-text-legend", entry.x + sample + 6.0, entry.y, "start", entry.text);
    svg += "</g>\n";
  }
}

void draw(std::string& svg, const PanelPlace& place, Data& data) {
  const Scale& y = place.area.y;
  fmt::format_to(Out(svg), "<g data-panel=\"{:g} {:g} {} {} {:d}\">\n", place.area.top,
                 place.area.bottom, y.min, y.max, y.log);
  axes(svg, place);
  std::string names;
  for (const Level& level : place.panel.levels) level_name(names, place, level);
  const bool field = !place.panel.contours.empty();  // names hide curves, but not areas
  if (!field) svg += names;
  svg += "<g fill=\"none\" stroke-linejoin=\"round\">\n";
  curves(svg, place, data);
  svg += "</g>\n";
  if (field) svg += names;
  contour_names(svg, place);
  text(svg, "pc-text-title", 2.0, place.area.title_y, "start", place.panel.title);
  legend(svg, place.area);
  svg += "</g>\n";
}

}  // namespace
}  // namespace figure_detail

std::string figure_svg(const Figure& figure, SvgKind kind) {
  using namespace figure_detail;
  const FigureLayout layout = lay_out(figure);
  const bool alone = kind == SvgKind::kStandAlone;
  std::string svg = alone ? "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" : "";
  svg += "<svg class=\"pc-figure\"";
  if (alone) svg += " xmlns=\"http://www.w3.org/2000/svg\"";
  fmt::format_to(Out(svg),
                 " viewBox=\"0 0 {:g} {:g}\" width=\"100%\" role=\"img\" aria-label=\"{}\"",
                 layout.width, layout.height, escape_html(figure.description));
  if (alone) {
    svg += ">\n<style>\n" + figure_css(kind) + "</style>\n";
    svg += "<rect class=\"pc-paper\" width=\"100%\" height=\"100%\"/>\n";
  } else {
    fmt::format_to(Out(svg), " data-view=\"{} {} {} {:.2f}\" data-x=\"{}\">\n", figure.x_min,
                   figure.x_max, layout.x.from, layout.x.to, escape_html(figure.x_label));
  }
  const bool field = std::any_of(figure.panels.begin(), figure.panels.end(),
                                 [](const Panel& panel) { return !panel.contours.empty(); });
  Data data(field && !alone ? SvgKind::kPicture : kind);
  for (std::size_t k = 0; k < figure.panels.size(); ++k)
    draw(svg, {figure, figure.panels[k], layout, layout.panels[k], kind}, data);
  text(svg, "pc-text-tick", layout.x.to, layout.height - 8.0, "end", figure.x_label);
  return svg + "</svg>\n";
}

}  // namespace photocoag
