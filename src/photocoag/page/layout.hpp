// Role: offline; internals of figures: layout. Used by page only.
// Units: px of the drawing, y downwards.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "photocoag/page/figure.hpp"

namespace photocoag::figure_detail {

/// Tick marks: first at or above the minimum, constant step, digits after the point that show it.
struct Ticks {
  double step = 1.0;
  int digits = 0;
};

/// About `wanted` ticks between low and high at 1, 2 or 5 times a power of ten.
Ticks choose_ticks(double low, double high, double wanted);

/// One legend entry: line sample and text.
struct LegendEntry {
  std::string text;
  Ink ink = Ink::kSeries1;
  Dash dash = Dash::kSolid;
  double width = 1.8;
  bool dot = false;   ///< a dot instead of a line
  bool area = false;  ///< a filled box instead of a line
  double x = 0.0;     ///< left end of the sample
  double y = 0.0;     ///< base line of the text
};

/// A range of values over a range of px; the first may lie behind the second.
struct Scale {
  double min = 0.0, max = 1.0;  ///< values
  double from = 0.0, to = 1.0;  ///< px of min and max
  bool log = false;
  /// Where a value lies, px.
  double operator()(double value) const noexcept;
};

struct PanelLayout {
  double top = 0.0, bottom = 0.0;  ///< of the plot area
  double title_y = 0.0;            ///< base line of the title
  Scale y;
  Ticks y_ticks;  ///< of a logarithmic axis the step is a factor
  std::vector<LegendEntry> legend;
};

struct FigureLayout {
  double width = 0.0, height = 0.0;
  Scale x;
  Ticks x_ticks;
  std::vector<PanelLayout> panels;
};

/// Throws Error if the figure is not valid (figure_svg says when).
FigureLayout lay_out(const Figure& figure);

/// Dash pattern in px as in stroke-dasharray, empty for solid.
std::string_view dash_pattern(Dash dash) noexcept;

/// The word of an ink in classes: "series-1", "limit".
std::string_view class_of(Ink ink) noexcept;

inline constexpr double kTickFont = 12.0;
inline constexpr double kSampleLength = 24.0;

}  // namespace photocoag::figure_detail
