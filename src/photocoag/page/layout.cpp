#include "photocoag/page/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "photocoag/core/error.hpp"

namespace photocoag::figure_detail {
namespace {

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

// Approximate width of a text in a sans-serif font, slightly overestimated; SVG cannot measure it.
double text_width(std::string_view text, double font) {
  double em = 0.0;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xC0) == 0x80) continue;  // inside a UTF-8 character
    if (std::string_view("ijl.,:;|!'()[] ft").find(c) != std::string_view::npos) {
      em += 0.33;
    } else if (std::string_view("mwMW@%").find(c) != std::string_view::npos) {
      em += 0.88;
    } else if (c >= 'A' && c <= 'Z') {
      em += 0.68;
    } else {
      em += 0.58;
    }
  }
  return em * font;
}

struct Range {
  double low = INFINITY, high = -INFINITY;
  void take(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

// Range of the panel's data inside the figure's x range; on a logarithmic axis of what is above 0.
Range data_range(const Panel& panel, const Figure& figure) {
  Range range;
  const auto take = [&](double x, double y) {
    if (x >= figure.x_min && x <= figure.x_max && (!panel.y_log || y > 0.0)) range.take(y);
  };
  for (const Series& series : panel.series)
    for (std::size_t k = 0; k < series.x.size(); ++k) take(series.x[k], series.y[k]);
  for (const Band& band : panel.bands)
    for (std::size_t k = 0; k < band.x.size(); ++k) {
      take(band.x[k], band.low[k]);
      take(band.x[k], band.high[k]);
    }
  for (const Level& level : panel.levels) take(figure.x_min, level.y);
  return range;
}

// Whole powers of ten around the values.
void choose_log_range(const Panel& panel, const Figure& figure, PanelLayout& layout) {
  Range range = data_range(panel, figure);
  if (!std::isfinite(range.low)) range = {1.0, 10.0};
  const auto power_of_ten = [](double exponent) { return std::pow(10.0, exponent); };
  Scale& y = layout.y;
  y.log = true;
  y.min = panel.y_min.value_or(power_of_ten(std::floor(std::log10(range.low))));
  y.max = panel.y_max.value_or(power_of_ten(std::ceil(std::log10(range.high) + 0.05)));
  if (!(y.max > y.min)) y.max = 10.0 * y.min;
  layout.y_ticks = {.step = 10.0, .digits = 0};
}

void choose_y_range(const Panel& panel, const Figure& figure, PanelLayout& layout) {
  if (panel.y_log) return choose_log_range(panel, figure, layout);
  Range range = data_range(panel, figure);
  if (!std::isfinite(range.low)) range = {0.0, 1.0};
  const double spread = std::max({range.high - range.low, 1e-3 * std::abs(range.high), 1e-12});
  const double height = layout.bottom - layout.top;
  Scale& y = layout.y;
  y.min = panel.y_min.value_or(range.low - 0.06 * spread);
  y.max = panel.y_max.value_or(range.high + 0.06 * spread);
  if (!panel.y_max)  // room for the name above the highest level
    for (const Level& level : panel.levels) {
      const double share = 16.0 / height;
      if (!level.label.empty() && !level.label_below)
        y.max = std::max(y.max, (level.y - share * y.min) / (1.0 - share));
    }
  if (!(y.max > y.min)) y.max = y.min + std::max(spread, 1e-12);
  layout.y_ticks = choose_ticks(y.min, y.max, height / 28.0);
}

std::vector<LegendEntry> legend_entries(const Panel& panel) {
  std::vector<LegendEntry> entries;
  for (const Series& series : panel.series)
    if (!series.legend.empty())
      entries.push_back({.text = series.legend,
                         .ink = series.ink,
                         .dash = series.dash,
                         .width = series.width,
                         .dot = series.mark == Mark::kPoints});
  for (const Band& band : panel.bands)
    if (!band.legend.empty())
      entries.push_back({.text = band.legend, .ink = band.ink, .area = true});
  return entries;
}

// Sets the entries from left to right, with line breaks. Returns the base line of the last row.
double place_legend(std::vector<LegendEntry>& entries, double left, double right, double first) {
  constexpr double kGap = 16.0;
  double x = left;
  double y = first;
  for (LegendEntry& entry : entries) {
    const double sample = entry.dot ? 6.0 : kSampleLength;
    const double length = sample + 6.0 + text_width(entry.text, kTickFont);
    if (x > left && x + length > right) {
      x = left;
      y += 17.0;
    }
    entry.x = x;
    entry.y = y;
    x += length + kGap;
  }
  return y;
}

}  // namespace

double Scale::operator()(double value) const noexcept {
  const double share =
      log ? std::log(value / min) / std::log(max / min) : (value - min) / (max - min);
  return from + share * (to - from);
}

Ticks choose_ticks(double low, double high, double wanted) {
  const double rough = (high - low) / std::max(wanted, 2.0);
  const double power = std::floor(std::log10(rough));
  const double unit = std::pow(10.0, power);
  double step = 10.0 * unit;
  for (const double factor : {5.0, 2.0, 1.0})
    if (factor * unit >= rough) step = factor * unit;
  return {step, std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)))};
}

std::string_view dash_pattern(Dash dash) noexcept {
  constexpr std::string_view names[] = {"", "7,4", "2,3", "8,3,2,3"};
  return names[static_cast<std::size_t>(dash)];
}

FigureLayout lay_out(const Figure& figure) {
  constexpr double kLeft = 46.0;
  constexpr double kXAxis = 44.0;  // tick labels and the axis label below the last panel
  constexpr double kXTicks = 34.0;
  check(figure);
  FigureLayout layout;
  layout.width = figure.width;
  layout.x_ticks = choose_ticks(figure.x_min, figure.x_max, (figure.width - 58.0) / 62.0);
  const double label =
      text_width(fmt::format("{:.{}f}", figure.x_max, layout.x_ticks.digits), kTickFont);
  const double right = figure.width - std::max(12.0, 0.5 * label + 2.0);
  layout.x = {.min = figure.x_min, .max = figure.x_max, .from = kLeft, .to = right};
  for (const Panel& drawn : figure.panels) {
    PanelLayout panel;
    panel.title_y = layout.height + 16.0;
    panel.legend = legend_entries(drawn);
    panel.top = 14.0 + (panel.legend.empty()
                            ? panel.title_y
                            : place_legend(panel.legend, 2.0, right, panel.title_y + 20.0));
    const double below = &drawn == &figure.panels.back() ? kXAxis : kXTicks;
    panel.bottom = layout.height + figure.panel_height - below;
    if (figure.equal_scale)
      panel.bottom = panel.top + (drawn.y_max.value_or(1.0) - drawn.y_min.value_or(0.0)) *
                                     (right - kLeft) / (figure.x_max - figure.x_min);
    choose_y_range(drawn, figure, panel);
    panel.y.from = drawn.y_down ? panel.top : panel.bottom;
    panel.y.to = drawn.y_down ? panel.bottom : panel.top;
    layout.height = panel.bottom + below;
    layout.panels.push_back(std::move(panel));
  }
  return layout;
}

}  // namespace photocoag::figure_detail
