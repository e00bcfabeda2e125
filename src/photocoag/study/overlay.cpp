#include "photocoag/study/overlay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

namespace photocoag {
namespace {

constexpr double kHeatingMs = 40.0;

void add_levels(Panel& panel, const std::set<double>& values, const Level& like) {
  for (const double value : values) {
    Level& level = panel.levels.emplace_back(like);
    level.label = fmt::format(fmt::runtime(like.label), value);
    level.y = value;
  }
}

}  // namespace

OverlayCurve overlay_curve(std::string label, const RunResult& result) {
  return {.label = std::move(label),
          .loop = result.trajectories.front(),
          .limit_K = result.config.control.peak_max,
          .reference_K = result.config.control.peak_reference,
          .absorption_true = result.config.plant.absorption_factor,
          .absorption_initial = result.config.estimator.absorption_initial};
}

Figure overlay_figure(const std::vector<OverlayCurve>& curves, const OverlayView& view) {
  Panel peak{.title = view.estimate ? "Peak temperature rise in K, estimate"
                                    : "Peak temperature rise in K",
             .y_min = 0.0};
  Panel apart{.title = view.against ? fmt::format("Peak less that of {} in K", view.against->label)
                                    : std::string()};
  Panel volume{.title = view.estimate ? "Volume temperature rise in K, measured"
                                      : "Volume temperature rise in K",
               .y_min = 0.0};
  Panel power{.title = "Laser power in mW", .y_min = 0.0};
  Panel alpha{.title = "Absorption factor, estimate"};
  std::set<double> limits, references, truths;
  for (const OverlayCurve& curve : curves) {
    const Trajectory& loop = curve.loop;
    limits.insert(curve.limit_K);
    references.insert(curve.reference_K);
    if (curve.absorption_true) truths.insert(*curve.absorption_true);
    if (loop.time_ms.empty()) continue;
    const std::vector<double> x = with_start(loop.time_ms, 0.0);
    Series line{.legend = curve.label,
                .x = x,
                .y = with_start(view.estimate ? loop.peak_estimate_K : loop.peak_K, 0.0),
                .ink = curve.ink,
                .dash = curve.dash};
    peak.series.push_back(line);
    line.legend.clear();
    if (view.against) {
      const std::vector<double>& other = view.against->loop.peak_K;
      Series& difference = apart.series.emplace_back(line);
      for (std::size_t k = 0; k < difference.y.size(); ++k) {
        difference.y[k] = k == 0              ? 0.0
                          : k <= other.size() ? loop.peak_K[k - 1] - other[k - 1]
                                              : std::numeric_limits<double>::quiet_NaN();
      }
    }
    line.y = with_start(view.estimate ? loop.measured_K : loop.volume_K, 0.0);
    volume.series.push_back(line);
    line.y = with_start(loop.power_mW, loop.power_mW.front());
    line.mark = Mark::kSteps;
    power.series.push_back(line);
    line.mark = Mark::kLine;
    if (curve.absorption_initial) {
      line.y = with_start(loop.absorption_factor, *curve.absorption_initial);
    } else {
      line.x = loop.time_ms;
      line.y = loop.absorption_factor;
    }
    alpha.series.push_back(std::move(line));
  }
  add_levels(peak, limits, {.label = "limit {:g} K", .ink = Ink::kLimit, .dash = Dash::kSolid});
  add_levels(peak, references,
             {.label = "reference {:g} K", .dash = Dash::kDotted, .label_below = true});
  add_levels(alpha, truths, {.label = "true {:g}", .dash = Dash::kDotted});
  Figure figure{
      .description =
          "Peak and volume temperature, laser power and estimated absorption factor over time",
      .x_label = "time in ms",
      .x_min = 0.0,
      .x_max = view.end_ms};
  figure.panels.push_back(std::move(peak));
  if (view.against) figure.panels.push_back(std::move(apart));
  for (Panel* panel : {&volume, &power, &alpha}) figure.panels.push_back(std::move(*panel));
  return figure;
}

std::vector<Figure> overlay_figures(std::vector<OverlayCurve> curves) {
  curves.resize(std::min(curves.size(), kMostCurves));
  double end = 0.0;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    curves[i].ink = static_cast<Ink>(i % 6);
    curves[i].dash = static_cast<Dash>(i / 6);
    if (!curves[i].loop.time_ms.empty()) end = std::max(end, curves[i].loop.time_ms.back());
  }
  std::vector<Figure> figures = {overlay_figure(curves, {.end_ms = end > 0.0 ? end : 1.0})};
  if (end > 2.0 * kHeatingMs) {
    figures.push_back(overlay_figure(curves, {.end_ms = kHeatingMs}));
    figures.back().description += ", heating phase";
  }
  for (Figure& figure : figures) {
    figure.width = 960.0;
    figure.panel_height = 260.0;
  }
  return figures;
}

}  // namespace photocoag
