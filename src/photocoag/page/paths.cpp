#include "photocoag/page/paths.hpp"

#include <fmt/format.h>

#include <cmath>
#include <initializer_list>
#include <iterator>
#include <utility>

namespace photocoag::figure_detail {
namespace {

void append_px(std::string& text, double px) {
  auto hundredths = std::llround(100.0 * px);
  if (hundredths < 0) text += '-';
  hundredths = std::abs(hundredths);
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{}", hundredths / 100);
  if (const auto rest = hundredths % 100; rest % 10 != 0) {
    fmt::format_to(out, ".{:02}", rest);
  } else if (rest != 0) {
    fmt::format_to(out, ".{}", rest / 10);
  }
}

// Index range of the points in view, with one neighbour on either side for the lines to the edge.
std::pair<std::ptrdiff_t, std::ptrdiff_t> in_view(const std::vector<double>& x,
                                                  const Figure& figure) {
  auto first = std::lower_bound(x.begin(), x.end(), figure.x_min);
  auto last = std::upper_bound(x.begin(), x.end(), figure.x_max);
  if (first != x.begin()) --first;
  if (last != x.end()) ++last;
  return {first - x.begin(), last - x.begin()};
}

template <class Curve>
Curve part_of(const Curve& curve, const Figure& figure,
              std::initializer_list<std::vector<double> Curve::*> columns) {
  const auto [begin, end] = in_view(curve.x, figure);
  Curve part = curve;
  for (const auto column : columns)
    part.*column = {(curve.*column).begin() + begin, (curve.*column).begin() + end};
  return decimate(part, figure.max_points);
}

// The part of a straight line inside the panel, as shares of its length; empty: first above last.
struct Inside {
  double first = 0.0, last = 1.0;
};

Inside inside(const PanelPlace& place, double ax, double ay, double bx, double by) {
  Inside part;
  const auto keep = [&part](double step, double room) {
    if (step < 0.0) part.first = std::max(part.first, room / step);
    if (step > 0.0) part.last = std::min(part.last, room / step);
    if (step == 0.0 && room < 0.0) part.last = -1.0;
  };
  keep(ax - bx, ax - place.left());
  keep(bx - ax, place.right() - ax);
  keep(ay - by, ay - place.area.top);
  keep(by - ay, place.area.bottom - ay);
  return part;
}

// A line through points, cut at the panel's edges.
class CutLine {
 public:
  CutLine(const PanelPlace& place, Path& path) : place_(place), path_(path) {}
  void to(double x, double y) {
    if (!std::isfinite(y)) {
      down_ = started_ = false;
      return;
    }
    if (started_) {
      const auto [first, last] = inside(place_, x_, y_, x, y);
      const double dx = x - x_, dy = y - y_;
      const bool drawn = first <= last;
      if (drawn && (!down_ || first > 0.0)) path_.move(x_ + first * dx, y_ + first * dy);
      if (drawn) path_.line(x_ + last * dx, y_ + last * dy);
      down_ = drawn && last == 1.0;
    }
    started_ = true;
    x_ = x;
    y_ = y;
  }

 private:
  const PanelPlace& place_;
  Path& path_;
  bool started_ = false, down_ = false;  // there is a last point; the path ends there
  double x_ = 0.0, y_ = 0.0;
};

Path line_of(const Series& series, const PanelPlace& place) {
  Path path;
  CutLine line(place, path);
  double before = NAN;
  for (std::size_t k = 0; k < series.x.size(); ++k) {
    const double x = place.x(series.x[k]), y = place.y(series.y[k]);
    const bool in_area = x >= place.left() - 0.01 && x <= place.right() + 0.01 &&
                         y >= place.area.top && y <= place.area.bottom;
    if (series.mark == Mark::kPoints) {
      if (in_area) path.dot(x, y);
      continue;
    }
    if (series.mark == Mark::kSteps && std::isfinite(before)) line.to(place.x(series.x[k - 1]), y);
    line.to(x, y);
    before = y;
  }
  return path;
}

// Bars stand on the panel's lower edge.
Path bars_of(const Series& series, const PanelPlace& place) {
  Path path;
  const auto x = [&](std::size_t k) {
    return std::clamp(place.x(series.x[k]), place.left(), place.right());
  };
  if (series.x.size() < 2) return path;
  path.move(x(0), place.area.bottom);
  for (std::size_t k = 1; k < series.x.size(); ++k) {
    const double y = std::isfinite(series.y[k]) ? place.y_inside(series.y[k]) : place.area.bottom;
    path.line(x(k - 1), y);
    path.line(x(k), y);
  }
  path.line(x(series.x.size() - 1), place.area.bottom);
  path.close();
  return path;
}

}  // namespace

void Path::point(char command, double x, double y) {
  d_ += command;
  append_px(d_, x);
  d_ += ' ';
  append_px(d_, y);
}

Series visible(const Series& series, const Figure& figure) {
  return part_of(series, figure, {&Series::x, &Series::y});
}

Band visible(const Band& band, const Figure& figure) {
  return part_of(band, figure, {&Band::x, &Band::low, &Band::high});
}

Path path_of(const Series& series, const PanelPlace& place) {
  return series.mark == Mark::kBars ? bars_of(series, place) : line_of(series, place);
}

Path path_of(const Band& band, const PanelPlace& place) {
  Path path;
  const auto finite = [&](std::size_t k) {
    return std::isfinite(band.low[k]) && std::isfinite(band.high[k]);
  };
  const double x_min = place.figure.x_min, x_max = place.figure.x_max;
  // A corner of one of the two curves; outside of the view where the line to its neighbour enters.
  const auto corner = [&](const std::vector<double>& y, std::size_t k, std::size_t begin,
                          std::size_t end) {
    const double x = std::clamp(band.x[k], x_min, x_max);
    double value = y[k];
    const std::size_t next = band.x[k] < x_min && k + 1 < end ? k + 1
                             : band.x[k] > x_max && k > begin ? k - 1
                                                              : k;
    if (next != k) value += (y[next] - y[k]) * (x - band.x[k]) / (band.x[next] - band.x[k]);
    path.line(place.x(x), place.y_inside(value));
  };
  for (std::size_t begin = 0, end = 0; begin < band.x.size(); begin = end + 1) {
    for (end = begin; end < band.x.size() && finite(end);) ++end;
    if (end - begin < 2) continue;
    path.move(place.x(std::clamp(band.x[begin], x_min, x_max)), place.y_inside(band.low[begin]));
    for (std::size_t k = begin; k < end; ++k) corner(band.low, k, begin, end);
    for (std::size_t k = end; k-- > begin;) corner(band.high, k, begin, end);
    path.close();
  }
  return path;
}

}  // namespace photocoag::figure_detail
