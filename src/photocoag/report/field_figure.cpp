#include "photocoag/report/field_figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "photocoag/report/html.hpp"
#include "photocoag/report/plot_layout.hpp"

namespace photocoag {
namespace {

using Out = std::back_insert_iterator<std::string>;

constexpr double kLeft = 46.0, kRight = 14.0, kTop = 44.0, kBottom = 36.0;  // px around the plot
constexpr double kLine = 15.0;                                              // px of a line of text
constexpr double kMicro = 1e6;

double center(const std::vector<double>& faces, std::size_t cell) {
  return 0.5 * (faces[cell] + faces[cell + 1]);
}

struct Hottest {
  double rise_K = 0.0;
  std::size_t axial = 0;
};

Hottest hottest(const TemperatureField& field) {
  Hottest place;
  for (std::size_t j = 0; j < field.axial_cells(); ++j) {
    if (field.at(0, j) > place.rise_K) place = {field.at(0, j), j};
  }
  return place;
}

// From metres to px of the drawing.
struct Frame {
  double radius, front, back;  // m: what is shown
  double scale;                // px per m
  double width, height;

  double x(double r) const { return kLeft + (r + radius) * scale; }
  double y(double depth) const { return kTop + (depth - front) * scale; }
  double right() const { return x(radius); }
  double bottom() const { return y(back); }
};

Frame frame_of(const TemperatureField& field, double width) {
  const double middle = center(field.depth_m, hottest(field).axial);
  Frame frame{};
  frame.radius = std::min(4.0 * field.spot_radius_m, field.radius_m.back());
  frame.front = std::max(field.depth_m.front(), middle - 300e-6);
  frame.back = std::min(field.depth_m.back(), middle + 450e-6);
  frame.width = width;
  frame.scale = (width - kLeft - kRight) / (2.0 * frame.radius);
  frame.height = kTop + (frame.back - frame.front) * frame.scale + kBottom;
  return frame;
}

void text(std::string& svg, std::string_view style, double x, double y, std::string_view anchor,
          const std::string& words) {
  fmt::format_to(Out(svg),
                 "<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n",
                 style, x, y, anchor, escape_html(words));
}

// One isotherm: down on the right side, up on the left. About a point for every px of depth, and
// its tips on the axis.
void isotherm(std::string& svg, const TemperatureField& field, const Frame& frame, double level) {
  std::vector<std::pair<double, double>> side;  // radius, y
  double last_y = -1e9;
  bool was_hot = false;
  for (std::size_t j = 0; j < field.axial_cells(); ++j) {
    const double y = frame.y(center(field.depth_m, j));
    const bool hot = field.at(0, j) >= level;
    if (j > 0 && hot != was_hot) {
      const double share = (level - field.at(0, j - 1)) / (field.at(0, j) - field.at(0, j - 1));
      const double before = frame.y(center(field.depth_m, j - 1));
      side.emplace_back(0.0, std::clamp(before + share * (y - before), kTop, frame.bottom()));
    }
    was_hot = hot;
    if (!hot || y < kTop - 1.0 || y > frame.bottom() + 1.0 || y - last_y < 1.0) continue;
    const double radius = std::min(isotherm_radius(field, j, level), frame.radius);
    side.emplace_back(radius, std::clamp(y, kTop, frame.bottom()));
    last_y = y;
  }
  std::string path;
  const auto point = [&](double radius, double y) {
    fmt::format_to(Out(path), "{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', frame.x(radius), y);
  };
  for (const auto& [radius, y] : side) point(radius, y);
  std::reverse(side.begin(), side.end());
  for (const auto& [radius, y] : side) {
    if (radius > 0.0) point(-radius, y);
  }
  if (path.empty()) return;
  fmt::format_to(Out(svg), "<path class=\"pc-area-series-2\" d=\"{}Z\"/>\n", path);
  fmt::format_to(Out(svg), "<path class=\"pc-line-series-2\" stroke-width=\"0.8\" d=\"{}Z\"/>\n",
                 path);
}

// Boundaries and names; layers too thin for a name share one above the first of them.
void layers(std::string& lines, std::string& words, const TemperatureField& field,
            const Frame& frame) {
  double front = 0.0;
  std::string thin;
  double thin_y = 0.0;
  const auto flush = [&] {
    if (!thin.empty()) {
      text(words, "pc-text-level pc-text-tick", frame.right() - 4.0, thin_y - 4.0, "end", thin);
    }
    thin.clear();
  };
  for (std::size_t k = 0; k < field.layer_names.size(); ++k) {
    const double top = std::clamp(frame.y(front), kTop, frame.bottom());
    const double end = std::clamp(frame.y(field.layer_back_m[k]), kTop, frame.bottom());
    front = field.layer_back_m[k];
    if (end - top <= 0.0) continue;
    if (end - top < kLine + 4.0) {
      if (thin.empty()) thin_y = top;
      thin += (thin.empty() ? "" : ", ") + field.layer_names[k];
    } else {
      flush();
      text(words, "pc-text-level pc-text-tick", kLeft + 6.0, top + kLine, "start",
           field.layer_names[k]);
    }
    if (end < frame.bottom() - 0.5) {
      fmt::format_to(Out(lines),
                     "<path class=\"pc-line-axis\" stroke-width=\"1\" d=\"M{} {:.1f}H{:.1f}\"/>\n",
                     kLeft, end, frame.right());
    }
  }
  flush();
}

void axes(std::string& lines, std::string& words, const Frame& frame) {
  fmt::format_to(
      Out(lines),
      "<path class=\"pc-line-axis\" stroke-width=\"1\" d=\"M{0} {1}H{2:.1f}V{3:.1f}H{0}Z\"/>"
      "\n",
      kLeft, kTop, frame.right(), frame.bottom());
  const double reach = frame.radius * kMicro;
  const plot_detail::Ticks across = plot_detail::choose_ticks(-reach, reach, frame.width / 60.0);
  for (double r = -std::floor(reach / across.step) * across.step; r <= reach; r += across.step) {
    const double x = frame.x(r / kMicro);
    fmt::format_to(Out(lines),
                   "<path class=\"pc-line-axis\" stroke-width=\"1\" d=\"M{:.1f} {:.1f}v4\"/>\n", x,
                   frame.bottom());
    text(words, "pc-text-tick", x, frame.bottom() + 16.0, "middle",
         fmt::format("{:.{}f}", std::abs(r), across.digits));
  }
  const plot_detail::Ticks down = plot_detail::choose_ticks(
      frame.front * kMicro, frame.back * kMicro, (frame.bottom() - kTop) / 50.0);
  for (double z = std::ceil(frame.front * kMicro / down.step) * down.step; z <= frame.back * kMicro;
       z += down.step) {
    const double y = frame.y(z / kMicro);
    fmt::format_to(Out(lines),
                   "<path class=\"pc-line-axis\" stroke-width=\"1\" d=\"M{} {:.1f}h-4\"/>\n", kLeft,
                   y);
    text(words, "pc-text-tick", kLeft - 7.0, y + 4.0, "end",
         fmt::format("{:.{}f}", z, down.digits));
  }
  text(words, "pc-text-tick", frame.right(), frame.height - 4.0, "end", "radius in µm");
  text(words, "pc-text-tick", 2.0, kTop - 8.0, "start", "depth in µm");
}

// The temperatures, written where the isotherms cross the axis behind the hottest place.
void names_of_levels(std::string& words, const TemperatureField& field, const Frame& frame,
                     const std::vector<double>& levels) {
  double last_y = 1e9;
  for (const double level : levels) {  // from the outside in
    std::size_t j = field.axial_cells();
    while (j > 0 && field.at(0, j - 1) < level) --j;
    if (j == 0 || j == field.axial_cells()) continue;
    const double y = frame.y(center(field.depth_m, j - 1));
    if (y > frame.bottom() - 4.0 || last_y - y < kLine) continue;
    text(words, "pc-text-level pc-text-legend", frame.x(0.0), y + 4.0, "middle",
         fmt::format("{:g}", level));
    last_y = y;
  }
}

}  // namespace

std::vector<double> isotherm_levels(const TemperatureField& field) {
  const double highest = hottest(field).rise_K;
  if (!(highest > 0.0) || !std::isfinite(highest)) return {};
  const double step = plot_detail::choose_ticks(0.0, highest, 8.0).step;
  std::vector<double> levels;
  for (int k = 1; k * step < highest; ++k) levels.push_back(k * step);
  return levels;
}

double isotherm_radius(const TemperatureField& field, std::size_t axial, double level) {
  std::size_t i = field.radial_cells();
  while (i > 0 && field.at(i - 1, axial) < level) --i;
  if (i == 0) return 0.0;
  const double inside = center(field.radius_m, i - 1);
  if (i == field.radial_cells()) return inside;
  const double hot = field.at(i - 1, axial);
  const double cold = field.at(i, axial);
  return inside + (center(field.radius_m, i) - inside) * (hot - level) / (hot - cold);
}

std::string field_svg(const TemperatureField& field, const FieldView& view) {
  const Frame frame = frame_of(field, view.width);
  const Hottest peak = hottest(field);
  const std::vector<double> levels = isotherm_levels(field);
  std::string areas, lines, words;
  for (const double level : levels) isotherm(areas, field, frame, level);
  layers(lines, words, field, frame);
  for (const double edge : {-field.spot_radius_m, field.spot_radius_m}) {
    fmt::format_to(Out(lines),
                   "<path class=\"pc-line-neutral\" stroke-width=\"1\" stroke-dasharray=\"4 3\" "
                   "d=\"M{:.1f} {}V{:.1f}\"/>\n",
                   frame.x(edge), kTop, frame.y(center(field.depth_m, peak.axial)));
  }
  text(words, "pc-text-tick", frame.x(0.0), kTop - 8.0, "middle", "laser spot");
  axes(lines, words, frame);
  names_of_levels(words, field, frame, levels);
  text(words, "pc-text-title", 2.0, 14.0, "start",
       fmt::format("Temperature rise in K after {:g} ms", field.time_s * 1e3));
  return fmt::format(
      "<svg class=\"pc-figure\" viewBox=\"0 0 {} {:.0f}\" width=\"100%\" role=\"img\" "
      "aria-label=\"Isotherms over radius and depth after {:g} ms: highest cell {:.2f} K at a "
      "depth "
      "of {:.0f} micrometres\">\n<g fill=\"none\" stroke-linejoin=\"round\">\n{}{}</g>\n{}</svg>\n",
      frame.width, frame.height, field.time_s * 1e3, peak.rise_K,
      center(field.depth_m, peak.axial) * kMicro, areas, lines, words);
}

}  // namespace photocoag
