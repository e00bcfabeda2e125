#include "photocoag/session/session_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "photocoag/page/page.hpp"

namespace photocoag {
namespace {

using Out = std::back_insert_iterator<std::string>;

// A shape of radius 1 around (0, 0), and the class of its colour.
struct MarkStyle {
  std::string_view path, style;
};
constexpr std::string_view kCircle = "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0Z";
constexpr std::string_view kRing = "M-.8 0a.8 .8 0 1 0 1.6 0a.8 .8 0 1 0-1.6 0Z";
constexpr std::string_view kTriangle = "M0-1L1 .8H-1Z";
constexpr std::string_view kDiamond = "M0-1.15L1.15 0L0 1.15L-1.15 0Z";
constexpr std::string_view kSquare = "M-.9-.9H.9V.9H-.9Z";
constexpr std::string_view kCross = "M-.85-.85L.85 .85M-.85 .85L.85-.85";
constexpr std::string_view kHalf = "M-.8-.8H.8V.8H-.8ZM-.8 .8L.8-.8";
// A ring around it, so that it is as large as the others.
constexpr std::string_view kQuestion =
    "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0ZM-.35-.28A.35 .35 0 1 1 .13 .08Q0 .16 0 .3M0 .54V.6";
constexpr std::string_view kDash = "M-.9 0H.9";

constexpr std::array<MarkStyle, kSpotEndings> kMarks = {{
    {kRing, "planned"},
    {kCircle, "treated"},
    {kTriangle, "missed"},
    {kDiamond, "alarm"},
    {kSquare, "alarm"},
    {kCross, "alarm-line"},
    {kHalf, "warning"},
    {kQuestion, "warning"},
    {kDash, "planned"},
}};

const MarkStyle& mark_of(SpotEnding ending) { return kMarks[static_cast<std::size_t>(ending)]; }

std::string shape(SpotEnding ending, double x, double y, double radius) {
  const MarkStyle& mark = mark_of(ending);
  return fmt::format(
      "<path class=\"spot-{}\" transform=\"translate({:.1f} {:.1f}) scale({:.2f})\" "
      "vector-effect=\"non-scaling-stroke\" d=\"{}\"/>",
      mark.style, x, y, radius, mark.path);
}

/// The spots' places on a drawing of some width.
struct MapLayout {
  double width, height, left, top, scale;                    // px; px per m
  double nearest = std::numeric_limits<double>::infinity();  // px, between two spots
  double x_min, y_max;                                       // m

  double x(double metres) const { return left + (metres - x_min) * scale; }
  double y(double metres) const { return top + (y_max - metres) * scale; }
};

double nearest_of(const Session& session) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < session.spots.size(); ++i) {
    for (std::size_t k = i + 1; k < session.spots.size(); ++k) {
      const double distance = std::hypot(session.spots[i].x - session.spots[k].x,
                                         session.spots[i].y - session.spots[k].y);
      if (distance > 0.0) nearest = std::min(nearest, distance);
    }
  }
  return nearest;
}

MapLayout lay_out(const Session& session, double width) {
  constexpr double kMargin = 44.0, kMostHeight = 560.0, kFoot = 40.0;
  double x_min = session.spots.front().x, x_max = x_min;
  double y_min = session.spots.front().y, y_max = y_min;
  for (const SpotPlan& spot : session.spots) {
    x_min = std::min(x_min, spot.x);
    x_max = std::max(x_max, spot.x);
    y_min = std::min(y_min, spot.y);
    y_max = std::max(y_max, spot.y);
  }
  constexpr double kLeast = 1e-6;  // m: one spot, or a row
  const double across = std::max(x_max - x_min, kLeast);
  const double down = std::max(y_max - y_min, kLeast);
  double scale = std::min((width - 2 * kMargin) / across, (kMostHeight - 2 * kMargin) / down);
  const double nearest = nearest_of(session);
  constexpr double kMostSpacing = 96.0;  // px
  if (std::isfinite(nearest)) scale = std::min(scale, kMostSpacing / nearest);
  if (x_max - x_min < kLeast && y_max - y_min < kLeast) scale = 1.0;
  MapLayout map{.width = width,
                .height = 2 * kMargin + (y_max - y_min) * scale + kFoot,
                .left = 0.5 * (width - (x_max - x_min) * scale),
                .top = kMargin,
                .scale = scale,
                .nearest = nearest * scale,
                .x_min = x_min,
                .y_max = y_max};
  return map;
}

// A length of 1, 2 or 5 times a power of ten near a quarter of the drawing, at its foot.
void scale_bar(std::string& svg, const MapLayout& map) {
  if (!std::isfinite(map.nearest)) return;
  const double wanted = 0.25 * map.width / map.scale;
  const double power = std::pow(10.0, std::floor(std::log10(wanted)));
  double length = power;
  for (const double step : {2.0, 5.0}) {
    if (step * power <= wanted) length = step * power;
  }
  const double y = map.height - 14.0;
  const double from = 16.0, to = from + length * map.scale;
  fmt::format_to(Out(svg),
                 "<path class=\"spot-scale\" d=\"M{0:.1f} {2:.1f}v6H{1:.1f}v-6\"/>"
                 "<text class=\"pc-text-tick\" x=\"{3:.1f}\" y=\"{4:.1f}\" "
                 "text-anchor=\"start\">{5:g} µm</text>",
                 from, to, y - 6.0, to + 8.0, y + 2.0, length * 1e6);
}

std::string map_svg(const Session& session, const SessionResult& result, double width) {
  const MapLayout map = lay_out(session, width);
  const double radius = std::clamp(0.26 * map.nearest, 3.0, 14.0);
  constexpr double kRoomForNames = 38.0;  // px
  const bool names = map.nearest >= kRoomForNames;
  std::string svg = fmt::format(
      "<svg class=\"pc-figure spot-map\" viewBox=\"0 0 {0:g} {1:.1f}\" width=\"{0:g}\" "
      "role=\"group\" aria-label=\"Map of {2} spots, each with its outcome\">",
      map.width, map.height, session.spots.size());
  for (std::size_t k = 0; k < session.spots.size(); ++k) {
    const SpotPlan& plan = session.spots[k];
    const SpotHistory& spot = result.spots[k];
    const double x = map.x(plan.x), y = map.y(plan.y);
    const std::string words = fmt::format("{}: {}", plan.name, words_of(spot.ending()));
    const bool linked = !spot.attempts.empty();
    if (linked) {
      fmt::format_to(Out(svg), "<a href=\"{}/report.html\" aria-label=\"{}\">",
                     escape_html(spot.attempts.back().folder), escape_html(words));
    }
    fmt::format_to(Out(svg), "<g><title>{}</title>{}", escape_html(words),
                   shape(spot.ending(), x, y, radius));
    if (names) {
      fmt::format_to(Out(svg),
                     "<text class=\"pc-text-tick\" x=\"{:.1f}\" y=\"{:.1f}\" "
                     "text-anchor=\"middle\">{}</text>",
                     x, y + radius + 15.0, escape_html(plan.name));
    }
    svg += linked ? "</g></a>\n" : "</g>\n";
  }
  scale_bar(svg, map);
  return svg + "</svg>";
}

}  // namespace

Html ending_mark(SpotEnding ending) {
  return Html::raw(
      fmt::format("<svg class=\"spot-key\" viewBox=\"0 0 16 16\" width=\"16\" "
                  "height=\"16\" aria-hidden=\"true\">{}</svg>",
                  shape(ending, 8.0, 8.0, 6.0)));
}

Html session_map(const Session& session, const SessionResult& result) {
  return figure_element(map_svg(session, result, 680.0), map_svg(session, result, 310.0));
}

Html map_legend(const SessionResult& result) {
  std::array<std::size_t, kSpotEndings> count{};
  for (const SpotHistory& spot : result.spots) ++count[static_cast<std::size_t>(spot.ending())];
  Html list;
  for (std::size_t k = 0; k < kSpotEndings; ++k) {
    if (count[k] == 0) continue;
    const auto ending = static_cast<SpotEnding>(k);
    list += element("li", {ending_mark(ending), fmt::format(" {} {}", count[k], words_of(ending))});
  }
  return element("ul.spot-legend", list);
}

std::string_view map_css() noexcept {
  return R"css(
.spot-map path,.spot-key path{stroke-width:2px}
.spot-treated{fill:var(--series-1);stroke:var(--series-1)}
.spot-missed{fill:var(--series-2);stroke:var(--series-2)}
.spot-alarm{fill:var(--limit);stroke:var(--limit)}
.spot-alarm-line{fill:none;stroke:var(--limit)}
.spot-warning{fill:none;stroke:var(--series-2)}
.spot-planned{fill:none;stroke:var(--muted)}
.spot-scale{fill:none;stroke:var(--axis);stroke-width:1.5px}
.spot-key{vertical-align:-2px}
.spot-legend{list-style:none;display:flex;flex-wrap:wrap;gap:6px 24px;margin:12px 0 0;padding:0;
font-size:.9375rem}
.spot-map{max-width:100%}
.data .words{text-align:left;white-space:normal;min-width:13rem}
.data .words small{display:block;color:var(--quiet)}
a{color:var(--series-1)}
)css";
}

}  // namespace photocoag
