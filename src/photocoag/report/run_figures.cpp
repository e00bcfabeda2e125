#include "photocoag/report/run_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photocoag/report/verdict.hpp"

namespace photocoag {
namespace {

std::vector<double> scaled(const std::vector<double>& values, double factor) {
  std::vector<double> result(values);
  for (double& value : result) value *= factor;
  return result;
}

void add(Panel& panel, Series series) {
  if (has_values(series.y)) panel.series.push_back(std::move(series));
}

// Temperatures start at zero unless the data go below it.
void start_at_zero(Panel& panel) {
  for (const Series& series : panel.series)
    for (const double y : series.y)
      if (y < 0.0) return;
  panel.y_min = 0.0;
}

Panel peak_panel(const RunLog& log, const RunSummary& summary, const RunConfig& config,
                 const std::vector<double>& time_ms) {
  Panel panel{.title = "Peak temperature rise in K"};
  add(panel, {.legend = "true", .x = time_ms, .y = log.peak_true_K, .ink = Ink::kSeries1});
  add(panel, {.legend = "estimate",
              .x = time_ms,
              .y = log.peak_estimate_K,
              .ink = Ink::kSeries2,
              .dash = Dash::kDashed});
  Band band{.legend = "95 %", .x = time_ms, .low = {}, .high = {}, .ink = Ink::kSeries2};
  Series allowed{.legend = "allowed by what is known",
                 .x = time_ms,
                 .y = {},
                 .ink = Ink::kSeries3,
                 .dash = Dash::kDotted};
  for (std::size_t k = 0; k < log.cycles(); ++k) {
    constexpr double kWithin = 1.96;  // 95 % of a normal distribution
    band.low.push_back(log.peak_estimate_K[k] - kWithin * log.peak_sigma_K[k]);
    band.high.push_back(log.peak_estimate_K[k] + kWithin * log.peak_sigma_K[k]);
    allowed.y.push_back(chance_aim(log, summary, k));
  }
  add(panel, std::move(allowed));
  if (has_values(band.low)) panel.bands.push_back(std::move(band));
  Series over{.legend = "over limit", .ink = Ink::kLimit, .mark = Mark::kPoints, .width = 4.0};
  for (std::size_t k = 0; k < log.cycles(); ++k)
    if (log.peak_true_K[k] > summary.limit_K) {
      over.x.push_back(time_ms[k]);
      over.y.push_back(log.peak_true_K[k]);
    }
  add(panel, std::move(over));
  panel.levels = {{.label = fmt::format("limit {:g} K", summary.limit_K),
                   .y = summary.limit_K,
                   .ink = Ink::kLimit,
                   .dash = Dash::kSolid},
                  {.label = fmt::format("reference {:g} K", config.peak_reference_K),
                   .y = config.peak_reference_K,
                   .ink = Ink::kNeutral,
                   .dash = Dash::kDotted,
                   .label_below = true}};
  start_at_zero(panel);
  return panel;
}

// Few samples: dots visible beside the lines; many: a cloud.
double dot_size(const std::vector<double>& time_ms, const RunView& view) {
  const auto in_view = std::count_if(time_ms.begin(), time_ms.end(), [&view](double t) {
    return t >= view.from_ms && t <= view.to_ms;
  });
  return in_view <= 60 ? 5.0 : in_view <= 150 ? 3.6 : 2.6;
}

Panel volume_panel(const RunLog& log, const std::vector<double>& time_ms, const RunView& view) {
  Panel panel{.title = "Volume temperature in K"};
  add(panel, {.legend = "measured",
              .x = time_ms,
              .y = log.volume_measured_K,
              .ink = Ink::kMuted,
              .mark = Mark::kPoints,
              .width = dot_size(time_ms, view)});
  add(panel, {.legend = "true", .x = time_ms, .y = log.volume_true_K, .ink = Ink::kSeries1});
  add(panel, {.legend = "estimate",
              .x = time_ms,
              .y = log.volume_estimate_K,
              .ink = Ink::kSeries2,
              .dash = Dash::kDashed});
  start_at_zero(panel);
  return panel;
}

Panel power_panel(const RunLog& log, const RunConfig& config, const std::vector<double>& time_ms) {
  Panel panel{.title = "Laser power in mW"};
  const auto steps = [&](const std::vector<double>& power_W) {
    return with_start(scaled(power_W, 1e3), 1e3 * power_W.front());
  };
  const std::vector<double> x = with_start(time_ms, 0.0);
  add(panel, {.legend = "applied",
              .x = x,
              .y = steps(log.power_W),
              .ink = Ink::kSeries1,
              .mark = Mark::kSteps,
              .width = 1.6});
  add(panel, {.legend = "reference power",
              .x = x,
              .y = steps(log.power_reference_W),
              .ink = Ink::kSeries3,
              .dash = Dash::kDotted,
              .mark = Mark::kSteps,
              .width = 1.4});
  const double bound = 1e3 * config.power_max_W;
  panel.levels = {{.label = fmt::format("bound {:g} mW", bound), .y = bound}};
  double highest = bound;
  for (const Series& series : panel.series)
    for (const double y : series.y)
      if (y > highest) highest = y;
  panel.y_min = 0.0;
  panel.y_max = 1.15 * highest;
  return panel;
}

// alpha or beta.
struct Factor {
  std::string title;
  const std::vector<double>& estimate;
  const std::vector<double>& sigma;
  std::optional<double> truth;
};

Panel factor_panel(const Factor& factor, const RunLog& log, const std::vector<double>& time_ms,
                   const RunView& view) {
  Panel panel{.title = factor.title};
  Band band{.legend = "±2 σ", .x = time_ms, .low = {}, .high = {}, .ink = Ink::kSeries2};
  for (std::size_t k = 0; k < log.cycles(); ++k) {
    band.low.push_back(factor.estimate[k] - 2.0 * factor.sigma[k]);
    band.high.push_back(factor.estimate[k] + 2.0 * factor.sigma[k]);
  }
  if (log.has_truth() && factor.truth)
    panel.series.push_back({.legend = fmt::format("true {:g}", *factor.truth),
                            .x = {view.from_ms, view.to_ms},
                            .y = {*factor.truth, *factor.truth},
                            .ink = Ink::kSeries1});
  add(panel, {.legend = "estimate",
              .x = time_ms,
              .y = factor.estimate,
              .ink = Ink::kSeries2,
              .dash = Dash::kDashed});
  if (has_values(band.low)) panel.bands.push_back(std::move(band));
  return panel;
}

// Samples minus their estimate: white noise if the estimate is good.
Panel residual_panel(const RunLog& log, const std::vector<double>& time_ms, const RunView& view) {
  std::vector<double> left = log.volume_measured_K;
  for (std::size_t k = 0; k < left.size(); ++k) left[k] -= log.volume_estimate_K[k];
  Panel panel{.title = "Volume less its estimate in K"};
  add(panel, {.legend = "measured less estimate",
              .x = time_ms,
              .y = std::move(left),
              .ink = Ink::kSeries1,
              .mark = Mark::kPoints,
              .width = dot_size(time_ms, view)});
  panel.levels = {{.label = "0 K", .y = 0.0}};
  return panel;
}

// Description of the figure for screen readers.
std::string describe(const Panel& panel, const RunView& view) {
  std::string text =
      fmt::format("{} over time, {:g} to {:g} ms.", panel.title, view.from_ms, view.to_ms);
  for (const Series& series : panel.series) {
    double low = INFINITY, high = -INFINITY, last = NAN;
    for (std::size_t k = 0; k < series.x.size(); ++k) {
      const double y = series.y[k];
      if (!std::isfinite(y) || series.x[k] < view.from_ms || series.x[k] > view.to_ms) continue;
      low = std::min(low, y);
      high = std::max(high, y);
      last = y;
    }
    if (std::isfinite(last))
      text +=
          fmt::format(" {}: {:.3g} to {:.3g}, at the end {:.3g}.", series.legend, low, high, last);
  }
  for (const Level& level : panel.levels) text += fmt::format(" Line: {}.", level.label);
  return text;
}

}  // namespace

std::vector<Figure> run_figures(const RunLog& log, const RunSummary& summary,
                                const RunConfig& config, const RunView& view) {
  const std::vector<double> time_ms = scaled(log.time_s, 1e3);
  std::vector<Figure> figures;
  std::vector<Panel> panels{
      peak_panel(log, summary, config, time_ms), volume_panel(log, time_ms, view),
      power_panel(log, config, time_ms),
      factor_panel({"Absorption factor (1 = reference value)", log.absorption_estimate,
                    log.absorption_sigma, config.absorption_true},
                   log, time_ms, view)};
  if (has_values(log.choroid_estimate)) {
    panels.push_back(factor_panel({"Choroid factor (1 = reference value)", log.choroid_estimate,
                                   log.choroid_sigma, config.choroid_true},
                                  log, time_ms, view));
  }
  if (has_values(log.volume_measured_K)) panels.push_back(residual_panel(log, time_ms, view));
  for (Panel& panel : panels) {
    Figure figure{.x_label = "time in ms", .x_min = view.from_ms, .x_max = view.to_ms};
    figure.description = describe(panel, view);
    figure.panels.push_back(std::move(panel));
    figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace photocoag
