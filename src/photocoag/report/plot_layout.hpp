// Role: offline; inside of plot: where everything of a figure lies. Used by plot*.cpp only.
// Units: px of the drawing, y downwards.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "photocoag/report/plot.hpp"

namespace photocoag::plot_detail {

/// Tick marks: first at or above the minimum, constant step, digits after the point that show it.
struct Ticks {
  double step = 1.0;
  int digits = 0;
};

/// About `wanted` ticks between low and high at 1, 2 or 5 times a power of ten.
Ticks choose_ticks(double low, double high, double wanted);

/// The sample of line and the words of one legend entry.
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

struct PanelLayout {
  double left = 0.0, right = 0.0, top = 0.0, bottom = 0.0;  ///< of the plot area
  double title_y = 0.0;                                     ///< base line of the title
  double y_min = 0.0, y_max = 1.0;
  Ticks y_ticks;
  bool y_log = false;  ///< then y_ticks.step is a factor
  std::vector<LegendEntry> legend;

  /// Where a value lies, px. Precondition: inside y_min and y_max.
  double height_of(double y) const noexcept;
};

struct FigureLayout {
  double width = 0.0, height = 0.0;
  Ticks x_ticks;
  std::vector<PanelLayout> panels;
};

FigureLayout lay_out(const Figure& figure);

/// Dash pattern in px as in stroke-dasharray, empty for solid.
std::string_view dash_pattern(Dash dash) noexcept;

inline constexpr double kTickFont = 12.0;
inline constexpr double kTitleFont = 13.0;
inline constexpr double kSampleLength = 24.0;

/// Roles of colours that are not inks.
enum class Part { kGrid, kAxis, kTick };

/// The colour that gnuplot draws with and that rewrite_svg() replaces by a class.
std::string placeholder(Part part);
std::string placeholder(Ink ink);
/// "pc-limit" and so on for a placeholder's blue value; empty if it is none of ours.
std::string_view class_of_placeholder(int code) noexcept;
std::string_view class_of(Ink ink) noexcept;

/// What gnuplot reads: numbers and placeholder colours only, none of the caller's words.
std::string gnuplot_script(const Figure& figure, const FigureLayout& layout);

/// One gnuplot drawing plus the caller's words -> the SVG that is handed out.
std::string rewrite_svg(std::string_view drawn, const Figure& figure, const FigureLayout& layout,
                        SvgKind kind);

}  // namespace photocoag::plot_detail
