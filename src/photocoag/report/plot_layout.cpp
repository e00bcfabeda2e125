#include "photocoag/report/plot_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace photocoag::plot_detail {
namespace {

// Width of a text in a usual sans-serif font, a little on the safe side; SVG has no way to ask.
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

// Range of the panel's data inside the figure's x range.
Range data_range(const Panel& panel, const Figure& figure) {
  Range range;
  const auto in_view = [&figure](double x) { return x >= figure.x_min && x <= figure.x_max; };
  for (const Series& series : panel.series)
    for (std::size_t k = 0; k < series.x.size(); ++k)
      if (in_view(series.x[k])) range.take(series.y[k]);
  for (const Band& band : panel.bands)
    for (std::size_t k = 0; k < band.x.size(); ++k)
      if (in_view(band.x[k])) {
        range.take(band.low[k]);
        range.take(band.high[k]);
      }
  for (const Level& level : panel.levels) range.take(level.y);
  return range;
}

// Whole powers of ten around the values above 0.
void choose_log_range(const Panel& panel, const Figure& figure, PanelLayout& layout) {
  Panel positive = panel;
  const auto drop = [](std::vector<double>& values) {
    for (double& value : values)
      if (!(value > 0.0)) value = std::numeric_limits<double>::quiet_NaN();
  };
  for (Series& series : positive.series) drop(series.y);
  for (Band& band : positive.bands) {
    drop(band.low);
    drop(band.high);
  }
  Range range = data_range(positive, figure);
  if (!std::isfinite(range.low)) range = {1.0, 10.0};
  const auto power_of_ten = [](double exponent) { return std::pow(10.0, exponent); };
  layout.y_log = true;
  layout.y_min = panel.y_min.value_or(power_of_ten(std::floor(std::log10(range.low))));
  layout.y_max = panel.y_max.value_or(power_of_ten(std::ceil(std::log10(range.high) + 0.05)));
  if (!(layout.y_max > layout.y_min)) layout.y_max = 10.0 * layout.y_min;
  layout.y_ticks = {.step = 10.0, .digits = 0};
}

void choose_y_range(const Panel& panel, const Figure& figure, PanelLayout& layout) {
  if (panel.y_log) return choose_log_range(panel, figure, layout);
  Range range = data_range(panel, figure);
  if (!std::isfinite(range.low)) range = {0.0, 1.0};
  const double spread = std::max({range.high - range.low, 1e-3 * std::abs(range.high), 1e-12});
  layout.y_min = panel.y_min.value_or(range.low - 0.06 * spread);
  layout.y_max = panel.y_max.value_or(range.high + 0.06 * spread);
  if (!panel.y_max)  // room for the name above the highest level
    for (const Level& level : panel.levels) {
      const double share = 16.0 / (layout.bottom - layout.top);
      if (!level.label.empty() && !level.label_below)
        layout.y_max = std::max(layout.y_max, (level.y - share * layout.y_min) / (1.0 - share));
    }
  if (!(layout.y_max > layout.y_min)) layout.y_max = layout.y_min + std::max(spread, 1e-12);
  layout.y_ticks = choose_ticks(layout.y_min, layout.y_max, (layout.bottom - layout.top) / 28.0);
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

double PanelLayout::height_of(double y) const noexcept {
  const double share =
      y_log ? std::log(y / y_min) / std::log(y_max / y_min) : (y - y_min) / (y_max - y_min);
  return bottom - share * (bottom - top);
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
  switch (dash) {
    case Dash::kSolid:
      return "";
    case Dash::kDashed:
      return "7,4";
    case Dash::kDotted:
      return "2,3";
    case Dash::kDashDotted:
      return "8,3,2,3";
  }
  return "";
}

FigureLayout lay_out(const Figure& figure) {
  constexpr double kXAxis = 44.0;  // tick labels and the axis label below the last panel
  constexpr double kXTicks = 34.0;
  FigureLayout layout;
  layout.width = figure.width;
  layout.x_ticks = choose_ticks(figure.x_min, figure.x_max, (figure.width - 58.0) / 62.0);
  const double label =
      text_width(fmt::format("{:.{}f}", figure.x_max, layout.x_ticks.digits), kTickFont);
  double top = 0.0;
  for (std::size_t k = 0; k < figure.panels.size(); ++k) {
    const bool last = k + 1 == figure.panels.size();
    PanelLayout panel;
    panel.left = 46.0;
    panel.right = figure.width - std::max(12.0, 0.5 * label + 2.0);
    panel.title_y = top + 16.0;
    panel.legend = legend_entries(figure.panels[k]);
    const double words = panel.legend.empty()
                             ? panel.title_y
                             : place_legend(panel.legend, 2.0, panel.right, panel.title_y + 20.0);
    panel.top = words + 14.0;
    const double end = top + figure.panel_height;
    panel.bottom = end - (last ? kXAxis : kXTicks);
    choose_y_range(figure.panels[k], figure, panel);
    layout.panels.push_back(std::move(panel));
    top = end;
  }
  layout.height = top;
  return layout;
}

}  // namespace photocoag::plot_detail
