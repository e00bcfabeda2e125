// Role: offline; figures of the report and of the paper as SVG. Used by report, studies.
// Source: the kind of figure of the paper's sections on simulation and experiments (panels over one
// time axis). Rules: colour-blind-safe, never colour alone, red for limits and alarms only.
// Differences: drawn by gnuplot (a child process), then rewritten: the SVG holds no id, no script,
// no time stamp and no program version, so that the same data give the same bytes and any number of
// figures fit on one page. Colours are classes (pc-…): one drawing serves light and dark.
// Units: the caller's; say them in Panel::title and Figure::x_label.
// Real-time promise: none. Threads: functions may be called from any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace photocoag {

/// What a mark means; the colour follows (Okabe-Ito hues, adapted to a light and a dark page).
enum class Ink {
  kSeries1,  ///< blue: by custom the true value
  kSeries2,  ///< orange: by custom the estimate
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

struct Panel {
  std::string title = {};  ///< quantity with unit, e.g. "Peak temperature rise in K"
  std::vector<Band> bands = {};
  std::vector<Series> series = {};
  std::vector<Level> levels = {};
  std::optional<double> y_min = {}, y_max = {};  ///< absent: from the data in view and the levels
  bool y_log = false;  ///< powers of ten; what is below y_min (a count of 0) is drawn at y_min
};

/// Panels above each other over one x axis.
struct Figure {
  std::string description = {};  ///< for people who cannot see it (aria-label)
  std::string x_label = {};      ///< with unit, e.g. "time in ms"
  double x_min = 0.0;
  double x_max = 1.0;  ///< above x_min
  std::vector<Panel> panels = {};
  double width = 520.0;           ///< px of the drawing; text is 12 to 13 px
  double panel_height = 240.0;    ///< px, with title, legend and tick labels
  std::size_t max_points = 2000;  ///< longer series are decimated to about this many
};

enum class SvgKind {
  kInline,      ///< for a page that contains plot_css(SvgKind::kInline) once
  kStandAlone,  ///< a file of its own, with colours for light and dark inside
};

struct PlotOptions {
  std::string gnuplot = "gnuplot";  ///< program to run; a path, or searched in PATH
};

/// Draws all figures with one run of gnuplot; result k is the SVG text of figure k.
/// Text is real text; width and height follow the container (viewBox).
/// Throws Error: gnuplot missing (names the package), gnuplot failed, or a figure that is not valid
/// (lengths differ, x not ascending, empty x range, not finite, a level or y_min that is not above
/// 0 where y is logarithmic).
std::vector<std::string> render_figures(std::span<const Figure> figures, SvgKind kind,
                                        const PlotOptions& options = {});

/// The style that gives the drawings their colours. kInline: CSS custom properties (--series-1,
/// --limit, --grid, …) on :root, dark by prefers-color-scheme on screens only, and the classes.
/// kStandAlone: the same with literal colours, for viewers without custom properties.
std::string plot_css(SvgKind kind);

/// All data of a figure, not decimated: `panel,curve,x,y,low,high` (y for series and levels, low
/// and high for bands; shortest text that reads back to the same number).
std::string figure_csv(const Figure& figure);

/// At most about `max_points` points of a series that show the same line: of each bin of neighbours
/// the lowest, the highest and a gap if there is one, in their order; first and last point kept.
/// No extreme value is lost: a spike of one sample stays. Shorter series come back unchanged.
Series decimate(const Series& series, std::size_t max_points);
/// The same for a band: of each bin its lowest `low` and its highest `high`.
Band decimate(const Band& band, std::size_t max_points);

}  // namespace photocoag
