// The figures of studies.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "photocoag/study/overlay.hpp"
#include "photocoag/study/reproduce.hpp"
#include "photocoag/study/timing.hpp"

namespace photocoag {
namespace {

Dash dash_of(const std::string& name) {
  if (name == "dashed") return Dash::kDashed;
  return name == "dotted" ? Dash::kDotted : Dash::kSolid;
}

Figure column_figure(const StudyOutcome& outcome, const StudyColumn& column) {
  std::vector<OverlayCurve> curves;
  for (const StudyRun& run : outcome.study.runs) {
    if (run.column != column.id) continue;
    curves.push_back(overlay_curve(run.label, run_of(outcome.results, run.id)));
    curves.back().ink = static_cast<Ink>(run.ink - 1);
    curves.back().dash = dash_of(run.dash);
  }
  OverlayView view{.end_ms = outcome.study.view_ms, .estimate = outcome.study.experiment};
  // Each column has its own: "_n20" stands for r1_n20 in the column with r1_n5.
  for (const StudyRun& run : outcome.study.runs) {
    if (outcome.study.difference_from.empty() || run.column != column.id) continue;
    if (!run.id.ends_with(outcome.study.difference_from)) continue;
    view.against = overlay_curve(run.label, run_of(outcome.results, run.id));
  }
  Figure figure = overlay_figure(curves, view);
  figure.description =
      fmt::format("{}, {}: {}", outcome.study.title, column.title, figure.description);
  return figure;
}

Figure timing_figure(const StudyOutcome& outcome) {
  Figure figure{.description = "Computation time of one optimal control problem over the horizon",
                .x_label = "horizon N",
                .x_min = 0.0,
                .x_max = outcome.study.horizons.back() + 1.0};
  Panel panel{
      .title =
          "Time per solve in µs (average solid; dashed: the paper's maximum, worst solve here)",
      .y_min = 0.0};
  const auto add = [&](const std::string& solver, Ink ink) {
    for (const bool maximum : {false, true}) {
      Series line{.legend = maximum ? "" : solver,
                  .ink = ink,
                  .dash = maximum ? Dash::kDashed : Dash::kSolid};
      for (const int horizon : outcome.study.horizons) {
        double us = 0.0;
        if (solver == "the paper's OSQP") {
          const PaperTime paper = paper_time(horizon);
          us = 1e3 * (maximum ? paper.maximum_ms : paper.average_ms);
        } else {
          const RunResult& run = run_of(outcome.results, fmt::format("{}_n{}", solver, horizon));
          us =
              statistic_of("median", run.measures.at(maximum ? "solve_worst_us" : "solve_mean_us"));
        }
        line.x.push_back(horizon);
        line.y.push_back(us);
      }
      panel.series.push_back(std::move(line));
    }
  };
  add("the paper's OSQP", Ink::kMuted);
  add("dense", Ink::kSeries1);
  const std::string with_osqp = fmt::format("osqp_n{}", outcome.study.horizons.front());
  const bool has_osqp = std::any_of(outcome.results.begin(), outcome.results.end(),
                                    [&](const RunResult& run) { return run.id == with_osqp; });
  if (has_osqp) add("osqp", Ink::kSeries2);
  figure.panels = {std::move(panel)};
  return figure;
}

// All seeds and quantities of a study, long form.
std::string data_csv(const StudyOutcome& outcome, const std::string& column) {
  std::string text =
      "run,seed,time_ms,peak_K,peak_estimate_K,volume_K,volume_measured_K,power_mW,"
      "power_reference_mW,absorption_estimate\n";
  for (const StudyRun& run : outcome.study.runs) {
    if (run.column != column) continue;
    const RunResult& result = run_of(outcome.results, run.id);
    for (std::size_t s = 0; s < result.trajectories.size(); ++s) {
      const Trajectory& t = result.trajectories[s];
      for (std::size_t k = 0; k < t.time_ms.size(); ++k) {
        fmt::format_to(std::back_inserter(text),
                       "{},{},{:.10g},{:.8g},{:.8g},{:.8g},{:.8g},{:.8g},{:.8g},{:.8g}\n", run.id,
                       result.config.run.seed + s, t.time_ms[k], t.peak_K[k], t.peak_estimate_K[k],
                       t.volume_K[k], t.measured_K[k], t.power_mW[k], t.power_reference_mW[k],
                       t.absorption_factor[k]);
      }
    }
  }
  return text;
}

}  // namespace

std::vector<StudyDrawing> draw_study(const StudyOutcome& outcome, std::vector<StudyFile>& files) {
  std::vector<StudyDrawing> drawings;
  const auto add = [&](const std::string& title, const std::string& column, Figure figure,
                       std::string csv) {
    const std::string name = column.empty() ? outcome.study.id : outcome.study.id + "-" + column;
    files.push_back({name + ".csv", std::move(csv)});
    files.push_back({name + ".svg", figure_svg(figure, SvgKind::kStandAlone)});
    drawings.push_back({title, std::move(figure), name + ".svg", name + ".csv"});
  };
  if (outcome.study.kind == StudyKind::kComputationTimes) {
    const Figure figure = timing_figure(outcome);
    add("Time per solve", "", figure, figure_csv(figure));
  }
  for (const StudyColumn& column : outcome.study.columns)
    add(column.title, column.id, column_figure(outcome, column), data_csv(outcome, column.id));
  return drawings;
}

}  // namespace photocoag
