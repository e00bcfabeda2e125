// The description of a figure as a gnuplot script: numbers and placeholder colours only.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "photocoag/report/plot_layout.hpp"

namespace photocoag::plot_detail {
namespace {

using Out = std::back_insert_iterator<std::string>;

// Index range of the points in view, with one neighbour on either side for the lines to the edge.
struct View {
  std::size_t begin = 0, end = 0;
};

View in_view(const std::vector<double>& x, const Figure& figure) {
  auto first = std::lower_bound(x.begin(), x.end(), figure.x_min);
  auto last = std::upper_bound(x.begin(), x.end(), figure.x_max);
  if (first != x.begin()) --first;
  if (last != x.end()) ++last;
  return {static_cast<std::size_t>(first - x.begin()), static_cast<std::size_t>(last - x.begin())};
}

std::vector<double> cut(const std::vector<double>& values, View view) {
  return {values.begin() + static_cast<std::ptrdiff_t>(view.begin),
          values.begin() + static_cast<std::ptrdiff_t>(view.end)};
}

Series visible(const Series& series, const Figure& figure) {
  const View view = in_view(series.x, figure);
  Series part = series;
  part.x = cut(series.x, view);
  part.y = cut(series.y, view);
  return decimate(part, figure.max_points);
}

Band visible(const Band& band, const Figure& figure) {
  const View view = in_view(band.x, figure);
  Band part = band;
  part.x = cut(band.x, view);
  part.low = cut(band.low, view);
  part.high = cut(band.high, view);
  return decimate(part, figure.max_points);
}

// gnuplot takes an empty line as a gap.
void write_data(std::string& script, std::string_view name, const Series& series) {
  fmt::format_to(Out(script), "{} << EOD\n", name);
  for (std::size_t k = 0; k < series.x.size(); ++k) {
    if (std::isfinite(series.y[k])) {
      fmt::format_to(Out(script), "{} {}\n", series.x[k], series.y[k]);
    } else {
      script += '\n';
    }
  }
  script += "EOD\n";
}

void write_data(std::string& script, std::string_view name, const Band& band) {
  fmt::format_to(Out(script), "{} << EOD\n", name);
  for (std::size_t k = 0; k < band.x.size(); ++k) {
    if (std::isfinite(band.low[k]) && std::isfinite(band.high[k])) {
      fmt::format_to(Out(script), "{} {} {}\n", band.x[k], band.low[k], band.high[k]);
    } else {
      script += '\n';
    }
  }
  script += "EOD\n";
}

// On a logarithmic axis a count of 0 lies on its lower end.
void raise(Series& series, double lowest) {
  for (double& y : series.y) y = y < lowest ? lowest : y;  // NaN stays
}

void raise(Band& band, double lowest) {
  for (double& y : band.low) y = y < lowest ? lowest : y;
  for (double& y : band.high) y = y < lowest ? lowest : y;
}

std::string line_style(Ink ink, Dash dash, double width) {
  const std::string pattern(dash_pattern(dash));
  return fmt::format("lw {} lc rgb \"{}\" dt {}", width, placeholder(ink),
                     pattern.empty() ? "1" : "(" + pattern + ")");
}

bool has_values(const std::vector<double>& y) {
  return std::any_of(y.begin(), y.end(), [](double value) { return std::isfinite(value); });
}

// Six digits have no room: 100k.
std::string tick_format(const PanelLayout& place) {
  if (!place.y_log) return fmt::format("%.{}f", place.y_ticks.digits);
  return place.y_max < 1e5 ? "%g" : "%.0s%c";
}

void write_panel(std::string& script, const Figure& figure, const Panel& panel,
                 const PanelLayout& place, const FigureLayout& layout) {
  const auto across = [&layout](double px) { return px / layout.width; };
  const auto upwards = [&layout](double px) { return 1.0 - px / layout.height; };
  fmt::format_to(Out(script),
                 "set lmargin at screen {}\nset rmargin at screen {}\n"
                 "set tmargin at screen {}\nset bmargin at screen {}\n",
                 across(place.left), across(place.right), upwards(place.top),
                 upwards(place.bottom));
  fmt::format_to(Out(script), "set yrange [{}:{}]\nset ytics {}\nset format y \"{}\"\n",
                 place.y_min, place.y_max, place.y_ticks.step, tick_format(place));
  if (place.y_log) script += "set logscale y 10\n";

  std::vector<std::string> plots = {"NaN"};  // a panel without data still has axes
  int count = 0;
  const auto add = [&](auto data, const std::string& style) {
    const std::string name = fmt::format("$d{}", count++);
    if (place.y_log) raise(data, place.y_min);
    write_data(script, name, data);
    plots.push_back(fmt::format("{} {}", name, style));
  };
  for (const Band& band : panel.bands)
    if (has_values(band.low))
      add(visible(band, figure),
          fmt::format("using 1:2:3 with filledcurves lc rgb \"{}\" fs solid noborder",
                      placeholder(band.ink)));
  for (const Level& level : panel.levels)
    add(Series{.x = {figure.x_min, figure.x_max}, .y = {level.y, level.y}},
        "using 1:2 with lines " + line_style(level.ink, level.dash, 1.2));
  for (const Series& series : panel.series) {
    if (!has_values(series.y)) continue;
    if (series.mark == Mark::kPoints) {
      add(visible(series, figure), fmt::format("using 1:2 with points pt 7 ps {} lc rgb \"{}\"",
                                               series.width, placeholder(series.ink)));
    } else {
      add(visible(series, figure),
          fmt::format("using 1:2 with {} {}", series.mark == Mark::kSteps ? "fsteps" : "lines",
                      line_style(series.ink, series.dash, series.width)));
    }
  }
  fmt::format_to(Out(script), "plot {}\n", fmt::join(plots, ", "));
  if (place.y_log) script += "unset logscale y\n";
}

}  // namespace

std::string gnuplot_script(const Figure& figure, const FigureLayout& layout) {
  std::string script;
  fmt::format_to(Out(script),
                 "reset\nset encoding utf8\n"
                 "set terminal svg size {},{} dynamic noenhanced font \"sans,{}\"\n",
                 layout.width, layout.height, kTickFont);
  fmt::format_to(Out(script),
                 "unset key\nset border 3 back lc rgb \"{}\" lw 1\n"
                 "set grid back lt 1 lc rgb \"{}\" lw 1\n"
                 "set tics out nomirror scale 0.5 textcolor rgb \"{}\"\n"
                 "set xtics offset 0,0.3\nset ytics offset 0.6,0\n",
                 placeholder(Part::kAxis), placeholder(Part::kGrid), placeholder(Part::kTick));
  fmt::format_to(Out(script), "set xrange [{}:{}]\nset xtics {}\nset format x \"%.{}f\"\n",
                 figure.x_min, figure.x_max, layout.x_ticks.step, layout.x_ticks.digits);
  script += "set multiplot\n";
  for (std::size_t k = 0; k < figure.panels.size(); ++k)
    write_panel(script, figure, figure.panels[k], layout.panels[k], layout);
  script += "unset multiplot\n";
  return script;
}

}  // namespace photocoag::plot_detail
