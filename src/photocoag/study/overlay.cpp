#include "photocoag/study/overlay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

namespace photocoag {
namespace {

constexpr double kHeatingMs = 40.0;

void add_levels(Panel& panel, const std::set<double>& values, std::string_view name, Ink ink,
                Dash dash, bool below) {
  for (const double value : values) {
    panel.levels.push_back({.label = fmt::format("{} {:g} K", name, value),
                            .y = value,
                            .ink = ink,
                            .dash = dash,
                            .label_below = below});
  }
}

}  // namespace

OverlayCurve overlay_curve(std::string label, const RunResult& result) {
  return {.label = std::move(label),
          .loop = result.trajectories.front(),
          .limit_K = result.config.control.peak_max,
          .reference_K = result.config.control.peak_reference};
}

std::vector<Figure> overlay_figures(const std::vector<OverlayCurve>& curves) {
  Panel peak{.title = "Peak temperature rise in K", .y_min = 0.0};
  Panel power{.title = "Laser power in mW", .y_min = 0.0};
  Panel alpha{.title = "Absorption factor, estimate"};
  std::set<double> limits;
  std::set<double> references;
  double end = 0.0;
  for (std::size_t i = 0; i < std::min(curves.size(), kMostCurves); ++i) {
    const Trajectory& loop = curves[i].loop;
    const auto ink = static_cast<Ink>(i % 6);
    const auto dash = static_cast<Dash>(i / 6);
    const auto series = [&](const std::vector<double>& y, bool legend, Mark mark) {
      return Series{.legend = legend ? curves[i].label : std::string(),
                    .x = loop.time_ms,
                    .y = y,
                    .ink = ink,
                    .dash = dash,
                    .mark = mark};
    };
    peak.series.push_back(series(loop.peak_K, true, Mark::kLine));
    power.series.push_back(series(loop.power_mW, false, Mark::kSteps));
    alpha.series.push_back(series(loop.absorption_factor, false, Mark::kLine));
    limits.insert(curves[i].limit_K);
    references.insert(curves[i].reference_K);
    end = std::max(end, loop.time_ms.empty() ? 0.0 : loop.time_ms.back());
  }
  add_levels(peak, limits, "limit", Ink::kLimit, Dash::kSolid, false);
  add_levels(peak, references, "reference", Ink::kNeutral, Dash::kDotted, true);
  Figure whole{.description =
                   "Peak temperature, laser power and estimated absorption of several "
                   "runs over one time axis",
               .x_label = "time in ms",
               .x_min = 0.0,
               .x_max = end > 0.0 ? end : 1.0,
               .panels = {std::move(peak), std::move(power), std::move(alpha)},
               .width = 960.0,
               .panel_height = 260.0};
  if (end <= 2.0 * kHeatingMs) return {std::move(whole)};
  Figure heating = whole;
  heating.description += ", heating phase";
  heating.x_max = kHeatingMs;
  return {std::move(whole), std::move(heating)};
}

}  // namespace photocoag
