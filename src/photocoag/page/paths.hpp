// Role: offline; internals of figures: lines and areas of curves, clipped to their panel. Used by
// page only. Units: px of the drawing, y downwards.
#pragma once

#include <algorithm>
#include <string>

#include "photocoag/page/layout.hpp"

namespace photocoag::figure_detail {

/// The data of a path element, px with two digits.
class Path {
 public:
  void move(double x, double y) { point('M', x, y); }
  void line(double x, double y) { point(d_.empty() ? 'M' : 'L', x, y); }
  void dot(double x, double y) {
    move(x, y);
    d_ += "h0";
  }
  void close() { d_ += 'Z'; }
  const std::string& text() const noexcept { return d_; }

 private:
  void point(char command, double x, double y);
  std::string d_;
};

/// One panel and its position.
struct PanelPlace {
  const Figure& figure;
  const Panel& panel;
  const FigureLayout& layout;
  const PanelLayout& area;
  SvgKind kind;

  double left() const { return layout.x.from; }
  double right() const { return layout.x.to; }
  double x(double value) const { return layout.x(value); }
  // On a logarithmic axis a count of 0 is drawn at the lower end.
  double y(double value) const {
    return area.y(area.y.log && value < area.y.min ? area.y.min : value);
  }
  double y_inside(double value) const { return std::clamp(y(value), area.top, area.bottom); }
  bool shows(double value) const { return value >= area.y.min && value <= area.y.max; }
};

/// The part of a curve that is drawn, with a neighbour on either side for the lines to the edge,
/// and decimated.
Series visible(const Series& series, const Figure& figure);
Band visible(const Band& band, const Figure& figure);

/// A series as lines, steps, dots or bars; bars stand on the panel's lower edge.
Path path_of(const Series& series, const PanelPlace& place);
/// The area of a band; a gap parts it.
Path path_of(const Band& band, const PanelPlace& place);

}  // namespace photocoag::figure_detail
