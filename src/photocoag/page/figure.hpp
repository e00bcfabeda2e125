// Role: offline; figures of reports, studies and documents as SVG. Used by page, report, study,
// campaign, apps. Source: the paper's figures (panels over one axis). Rules: colour-blind-safe,
// never colour alone, red for limits and alarms only.
// Differences: colours are classes (pc-…), so that one drawing works in light and dark; no id, no
// time stamp, no program version: the same data give the same bytes, and any number of figures fit
// on one page. Units: the caller's; say them in Panel::title and Figure::x_label ("time in ms").
// Real-time promise: none. Threads: functions may be called from any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "photocoag/page/isolines.hpp"

namespace photocoag {

/// Meaning of a mark, which determines its colour (Okabe-Ito hues, adapted to light and dark
/// pages).
enum class Ink {
  kSeries1,  ///< blue: by convention the true value
  kSeries2,  ///< orange: by convention the estimate
  kSeries3,  ///< green
  kSeries4,  ///< purple
  kSeries5,  ///< sky blue
  kSeries6,  ///< ochre
  kNeutral,  ///< text colour: references, bounds
  kMuted,    ///< grey: raw samples, background information
  kLimit,    ///< red: safety limits and what exceeds them, nothing else
};

enum class Dash { kSolid, kDashed, kDotted, kDashDotted };

/// How the points of a series are joined.
enum class Mark {
  kLine,    ///< straight lines; a NaN in y leaves a gap
  kSteps,   ///< y[k] holds from x[k-1] to x[k] (a power applied during a cycle that ends at x[k])
  kBars,    ///< steps that stand on the axis, filled: a histogram with edges x
  kPoints,  ///< separate dots
};

struct Series {
  std::string legend = {};     ///< empty: not in the legend
  std::vector<double> x = {};  ///< ascending, finite
  std::vector<double> y = {};  ///< same length; NaN: no value here
  Ink ink = Ink::kSeries1;
  Dash dash = Dash::kSolid;
  Mark mark = Mark::kLine;
  double width = 1.8;  ///< of the line, or diameter of the dots, in px of the drawing
};

/// Area between two curves, drawn below all lines (e.g. estimate +- 2 sigma).
struct Band {
  std::string legend = {};
  std::vector<double> x = {}, low = {}, high = {};  ///< same length; NaN: gap
  Ink ink = Ink::kSeries2;
};

/// Horizontal line over the whole width with its name written at its right end.
struct Level {
  std::string label = {};
  double y = 0.0;
  Ink ink = Ink::kNeutral;
  Dash dash = Dash::kDashed;
  bool label_below = false;  ///< below the line instead of above
};

/// Contour of a field over x and y at one value: lines, the area inside, and a label below.
struct Contour {
  std::string label = {};
  std::vector<Isoline> lines = {};
  Ink ink = Ink::kSeries2;
};

struct Panel {
  std::string title = {};  ///< quantity with unit, e.g. "Peak temperature rise in K"
  std::vector<Band> bands = {};
  std::vector<Series> series = {};
  std::vector<Level> levels = {};
  std::vector<Contour> contours = {};            ///< inside the ranges of x and y
  std::optional<double> y_min = {}, y_max = {};  ///< absent: from the data in view and the levels
  bool y_log = false;   ///< powers of ten; what is below y_min (a count of 0) is drawn at y_min
  bool y_down = false;  ///< a depth: y_min is at the top
};

/// Panels above each other over one x axis.
struct Figure {
  std::string description = {};  ///< for screen readers (aria-label)
  std::string x_label = {};      ///< with unit, e.g. "time in ms"
  double x_min = 0.0;
  double x_max = 1.0;  ///< above x_min
  std::vector<Panel> panels = {};
  double width = 520.0;           ///< px of the drawing; text is 12 to 13 px
  double panel_height = 240.0;    ///< px, with title, legend and tick labels
  std::size_t max_points = 2000;  ///< longer series are decimated to about this many
  bool mirrored = false;          ///< x counts from the middle to both sides: no sign at the ticks
  bool equal_scale = false;       ///< a unit of y is as long as one of x; panel_height follows
};

enum class SvgKind {
  kInline,      ///< for a page that contains figure_css(SvgKind::kInline) once
  kPicture,     ///< the same without the data that the page's script reads
  kStandAlone,  ///< a file of its own, with colours for light and dark inside
};

/// Text is real text; width and height follow the container (viewBox).
/// Throws Error: a figure that is not valid (lengths differ, x not ascending, empty x range, not
/// finite, a level or y_min that is not above 0 where y is logarithmic).
std::string figure_svg(const Figure& figure, SvgKind kind);

/// The style that gives the drawings their colours. kInline: CSS custom properties (--series-1,
/// --limit, --grid, …) on :root, dark by prefers-color-scheme on screens only, and the classes.
/// kStandAlone: the same with literal colours, for viewers without custom properties.
std::string figure_css(SvgKind kind);

/// All data of a figure, not decimated: `panel,curve,x,y,low,high` (y for series and levels, low
/// and high for bands; shortest text that reads back to the same number).
std::string figure_csv(const Figure& figure);

/// True if any value is a number.
bool has_values(const std::vector<double>& values) noexcept;

/// `start`, the value before the end of the first cycle, followed by the values.
std::vector<double> with_start(const std::vector<double>& values, double start);

/// At most about `max_points` points of a series that show the same line: of each bin of neighbours
/// the lowest, the highest and a gap if there is one, in their order; first and last point kept.
/// No extreme value is lost: a spike of one sample stays. Shorter series come back unchanged.
Series decimate(const Series& series, std::size_t max_points);
/// The same for a band: of each bin its lowest `low` and its highest `high`.
Band decimate(const Band& band, std::size_t max_points);

}  // namespace photocoag
