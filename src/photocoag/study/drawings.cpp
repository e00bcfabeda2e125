// The figures of studies.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "photocoag/study/reproduce.hpp"
#include "photocoag/study/timing.hpp"

namespace photocoag {
namespace {

constexpr std::array<Ink, 6> kInks = {Ink::kSeries1, Ink::kSeries2, Ink::kSeries3,
                                      Ink::kSeries4, Ink::kSeries5, Ink::kSeries6};

Dash dash_of(const std::string& name) {
  if (name == "dashed") return Dash::kDashed;
  return name == "dotted" ? Dash::kDotted : Dash::kSolid;
}

const RunResult* find(const std::vector<RunResult>& results, const std::string& id) {
  for (const RunResult& result : results) {
    if (result.id == id) return &result;
  }
  return nullptr;
}

Series series(const StudyRun& run, const std::vector<double>& x, const std::vector<double>& y,
              bool legend, Mark mark = Mark::kLine) {
  return {.legend = legend ? run.label : std::string(),
          .x = x,
          .y = y,
          .ink = kInks[static_cast<std::size_t>(run.ink - 1)],
          .dash = dash_of(run.dash),
          .mark = mark};
}

// The temperature is 0 at the start: the first cycle's heating is part of the picture.
std::vector<double> with_start(const std::vector<double>& values, double start) {
  std::vector<double> all = {start};
  all.insert(all.end(), values.begin(), values.end());
  return all;
}

Figure column_figure(const StudyOutcome& outcome, const StudyColumn& column) {
  Figure figure{.description = fmt::format("{}, {}: peak temperature, laser power and estimated "
                                           "absorption factor over time",
                                           outcome.study.title, column.title),
                .x_label = "time in ms",
                .x_min = 0.0,
                .x_max = outcome.study.view_ms};
  Panel peak{.title = "Peak temperature rise in K", .y_min = 0.0};
  Panel power{.title = "Laser power in mW", .y_min = 0.0};
  Panel alpha{.title = "Absorption factor, estimate"};
  const RunResult* any = nullptr;
  std::vector<double> truths;
  for (const StudyRun& run : outcome.study.runs) {
    if (run.column != column.id) continue;
    any = find(outcome.results, run.id);
    const Trajectory& loop = any->trajectories.front();
    peak.series.push_back(
        series(run, with_start(loop.time_ms, 0.0), with_start(loop.peak_K, 0.0), true));
    // From the start of the first cycle: steps hold the value of their end.
    power.series.push_back(series(run, with_start(loop.time_ms, 0.0),
                                  with_start(loop.power_mW, loop.power_mW.front()), false,
                                  Mark::kSteps));
    alpha.series.push_back(series(run, loop.time_ms, loop.absorption_factor, false));
    const double truth = any->config.plant.absorption_factor;
    if (std::find(truths.begin(), truths.end(), truth) == truths.end()) truths.push_back(truth);
  }
  if (any != nullptr) {
    const ControlSettings& control = any->config.control;
    peak.levels = {{.label = fmt::format("limit {:g} K", control.peak_max),
                    .y = control.peak_max,
                    .ink = Ink::kLimit,
                    .dash = Dash::kSolid},
                   {.label = fmt::format("reference {:g} K", control.peak_reference),
                    .y = control.peak_reference,
                    .dash = Dash::kDotted,
                    .label_below = true}};
    for (const double truth : truths) {
      alpha.levels.push_back(
          {.label = fmt::format("true {:g}", truth), .y = truth, .dash = Dash::kDotted});
    }
  }
  figure.panels = {std::move(peak), std::move(power), std::move(alpha)};
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
          const RunResult* run = find(outcome.results, fmt::format("{}_n{}", solver, horizon));
          us = statistic_of("median",
                            run->measures.at(maximum ? "solve_worst_us" : "solve_mean_us"));
        }
        line.x.push_back(horizon);
        line.y.push_back(us);
      }
      panel.series.push_back(std::move(line));
    }
  };
  add("the paper's OSQP", Ink::kMuted);
  add("dense", Ink::kSeries1);
  if (find(outcome.results, fmt::format("osqp_n{}", outcome.study.horizons.front())) != nullptr) {
    add("osqp", Ink::kSeries2);
  }
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
    const RunResult& result = *find(outcome.results, run.id);
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
