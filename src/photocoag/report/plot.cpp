#include "photocoag/report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <limits>

#include "photocoag/core/error.hpp"
#include "photocoag/core/process.hpp"
#include "photocoag/report/plot_layout.hpp"

namespace photocoag {
namespace {

using Out = std::back_insert_iterator<std::string>;

void check_axis(const std::vector<double>& x, std::string_view name) {
  for (std::size_t k = 0; k < x.size(); ++k)
    if (!std::isfinite(x[k]) || (k > 0 && x[k] < x[k - 1]))
      throw Error({.key = std::string(name),
                   .found = fmt::format("x[{}] = {}", k, x[k]),
                   .accepted = "finite, ascending x"});
}

void check_length(std::size_t found, std::size_t expected, std::string_view name) {
  if (found != expected)
    throw Error({.key = std::string(name),
                 .found = fmt::format("{} values for {} x", found, expected),
                 .accepted = "as many values as x"});
}

void check(const Figure& figure) {
  if (!std::isfinite(figure.x_min) || !std::isfinite(figure.x_max) ||
      !(figure.x_max > figure.x_min))
    throw Error({.key = "x range of a figure",
                 .found = fmt::format("{} to {}", figure.x_min, figure.x_max),
                 .accepted = "finite, x_min below x_max"});
  if (figure.panels.empty()) throw Error("a figure needs at least one panel");
  for (const Panel& panel : figure.panels) {
    for (const Series& series : panel.series) {
      check_axis(series.x, panel.title + ", " + series.legend);
      check_length(series.y.size(), series.x.size(), panel.title + ", " + series.legend);
    }
    for (const Band& band : panel.bands) {
      check_axis(band.x, panel.title + ", " + band.legend);
      check_length(band.low.size(), band.x.size(), panel.title + ", " + band.legend);
      check_length(band.high.size(), band.x.size(), panel.title + ", " + band.legend);
    }
    for (const Level& level : panel.levels)
      if (!std::isfinite(level.y) || (panel.y_log && level.y <= 0.0))
        throw Error({.key = panel.title + ", " + level.label,
                     .found = fmt::format("{}", level.y),
                     .accepted = panel.y_log ? "a finite level above 0" : "a finite level"});
    if (panel.y_log && panel.y_min && !(*panel.y_min > 0.0))
      throw Error({.key = panel.title + ", y_min",
                   .found = fmt::format("{}", *panel.y_min),
                   .accepted = "above 0, y is logarithmic"});
  }
}

std::string last_line(std::string text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0)
    text.pop_back();
  return text.substr(text.rfind('\n') + 1);  // npos + 1 is 0
}

std::string draw(const std::string& script, const PlotOptions& options) {
  const ProgramResult result = run_program({options.gnuplot, "-d"}, {.input = script});
  if (!result.found)
    throw Error({.where = options.gnuplot,
                 .problem = "program not found, the plots need it",
                 .accepted = "gnuplot 5.4 or newer (Debian: apt-get install gnuplot-nox)"});
  if (result.exit_code != 0)
    throw Error({.where = options.gnuplot,
                 .problem = fmt::format("ended with code {}: {}", result.exit_code,
                                        last_line(result.errors))});
  return result.output;
}

// Cuts the drawings apart: each begins with <svg and ends with </svg>.
std::vector<std::string_view> split_drawings(std::string_view text) {
  constexpr std::string_view kEnd = "</svg>";
  std::vector<std::string_view> drawings;
  for (std::size_t at = text.find("<svg"); at != std::string_view::npos;
       at = text.find("<svg", at)) {
    std::size_t end = text.find(kEnd, at);
    end = end == std::string_view::npos ? text.size() : end + kEnd.size();
    drawings.push_back(text.substr(at, end - at));
    at = end;
  }
  return drawings;
}

void append_value(std::string& csv, double value) {
  csv += ',';
  if (std::isfinite(value)) fmt::format_to(Out(csv), "{}", value);
}

// A CSV field in quotes if it has to be.
std::string field(std::string_view text) {
  if (text.find_first_of(",\"\n\r") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

}  // namespace

std::vector<std::string> render_figures(std::span<const Figure> figures, SvgKind kind,
                                        const PlotOptions& options) {
  if (figures.empty()) return {};
  std::string script;
  std::vector<plot_detail::FigureLayout> layouts;
  for (const Figure& figure : figures) {
    check(figure);
    layouts.push_back(plot_detail::lay_out(figure));
    script += plot_detail::gnuplot_script(figure, layouts.back());
  }
  const std::string drawn = draw(script, options);
  const std::vector<std::string_view> drawings = split_drawings(drawn);
  if (drawings.size() != figures.size())
    throw Error({.where = options.gnuplot,
                 .problem = "did not draw all figures",
                 .found = fmt::format("{} drawings", drawings.size()),
                 .accepted = fmt::format("{}", figures.size())});
  std::vector<std::string> result;
  for (std::size_t k = 0; k < figures.size(); ++k)
    result.push_back(plot_detail::rewrite_svg(drawings[k], figures[k], layouts[k], kind));
  return result;
}

std::string figure_csv(const Figure& figure) {
  std::string csv = "panel,curve,x,y,low,high\n";
  for (const Panel& panel : figure.panels) {
    const auto begin_row = [&](std::string_view curve, double x) {
      csv += field(panel.title) + ',' + field(curve);
      append_value(csv, x);
    };
    for (const Series& series : panel.series)
      for (std::size_t k = 0; k < series.x.size(); ++k) {
        begin_row(series.legend, series.x[k]);
        append_value(csv, series.y[k]);
        csv += ",,\n";
      }
    for (const Band& band : panel.bands)
      for (std::size_t k = 0; k < band.x.size(); ++k) {
        begin_row(band.legend, band.x[k]);
        csv += ',';
        append_value(csv, band.low[k]);
        append_value(csv, band.high[k]);
        csv += '\n';
      }
    for (const Level& level : panel.levels)
      for (const double x : {figure.x_min, figure.x_max}) {
        begin_row(level.label, x);
        append_value(csv, level.y);
        csv += ",,\n";
      }
  }
  return csv;
}

Series decimate(const Series& series, std::size_t max_points) {
  const std::size_t count = series.x.size();
  if (count <= max_points || count < 3) return series;
  const std::size_t bins = std::max<std::size_t>(1, max_points / 2);
  std::vector<std::size_t> kept = {0};
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const std::size_t begin = bin * count / bins;
    const std::size_t end = (bin + 1) * count / bins;
    std::size_t lowest = end, highest = end, gap = end;
    for (std::size_t k = begin; k < end; ++k) {
      if (!std::isfinite(series.y[k])) {
        gap = std::min(gap, k);
        continue;
      }
      if (lowest == end || series.y[k] < series.y[lowest]) lowest = k;
      if (highest == end || series.y[k] > series.y[highest]) highest = k;
    }
    for (const std::size_t k : {lowest, highest, gap})
      if (k != end) kept.push_back(k);
  }
  kept.push_back(count - 1);
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  Series result = series;
  result.x.clear();
  result.y.clear();
  for (const std::size_t k : kept) {
    result.x.push_back(series.x[k]);
    result.y.push_back(series.y[k]);
  }
  return result;
}

Band decimate(const Band& band, std::size_t max_points) {
  const std::size_t count = band.x.size();
  if (count <= max_points || count < 3) return band;
  const std::size_t bins = std::max<std::size_t>(1, max_points);
  Band result{.legend = band.legend, .x = {}, .low = {}, .high = {}, .ink = band.ink};
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const std::size_t begin = bin * count / bins;
    const std::size_t end = (bin + 1) * count / bins;
    double low = INFINITY, high = -INFINITY;
    for (std::size_t k = begin; k < end; ++k) {
      if (band.low[k] < low) low = band.low[k];  // false for NaN
      if (band.high[k] > high) high = band.high[k];
    }
    const bool empty = !(low <= high);
    const bool last = bin + 1 == bins;
    result.x.push_back(band.x[last ? end - 1 : begin]);
    result.low.push_back(empty ? std::numeric_limits<double>::quiet_NaN() : low);
    result.high.push_back(empty ? std::numeric_limits<double>::quiet_NaN() : high);
  }
  return result;
}

}  // namespace photocoag
