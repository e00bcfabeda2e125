// index.html, tables and figures of `explain`.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "photocoag/core/files.hpp"
#include "photocoag/page/page.hpp"
#include "photocoag/run/run_folder.hpp"
#include "photocoag/study/explain.hpp"
#include "photocoag/study/expression.hpp"
#include "photocoag/study/overlay.hpp"

namespace photocoag {
namespace {

constexpr std::string_view kCss = R"css(
.data{width:100%}
.data tbody th{white-space:normal;min-width:13rem}
.data tbody td{white-space:normal}
)css";

constexpr std::size_t kShownSets = 12;
constexpr double kHalf = 0.5;  // a statement is typical of a set if it holds in so many repetitions

Html side_by_side(const std::vector<Figure>& figures) {
  Html all;
  for (const Figure& figure : figures) all += figure_element(figure);
  return element("div.columns.count-2", all);
}

std::size_t typical(const Repetitions& all) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < all.seen.size(); ++i) count += all.share(i) >= kHalf ? 1 : 0;
  return count;
}

// "4.2 (3.9 to 4.6)": median and the middle 95 % of the repetitions.
std::string spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(
        std::lround(share * static_cast<double>(values.size() - 1)))];
  };
  return fmt::format("{:.2f} ({:.2f} to {:.2f})", at(0.5), at(0.025), at(0.975));
}

std::string percent(std::size_t hits, std::size_t of) { return fmt::format("{} of {}", hits, of); }

std::string signs_of(const Repetitions& all) {
  std::string signs;
  for (std::size_t i = 0; i < all.seen.size(); ++i) signs += all.share(i) >= kHalf ? "✓" : "·";
  return signs;
}

// Sets in words, by what differs from `from`.
Html points_table(const Explanation& study, const std::vector<ExplainedPoint>& points,
                  const ExplainedPoint& from, std::size_t most, std::string_view name) {
  Table shown{
      .head = {"set", "statements that hold,\nmean of a repetition", "1 to n: ✓ in half or more"},
      .rows = {}};
  for (std::size_t k = 0; k < std::min(most, points.size()); ++k) {
    shown.rows.push_back({words_of(study, points[k].levels, from.levels),
                          fmt::format("{:.1f}", points[k].repetitions.mean_held()),
                          signs_of(points[k].repetitions)});
  }
  return table(shown, name);
}

Html statements_table(const ExplainOutcome& outcome) {
  const ConfirmedSet& best = outcome.confirmed.front();
  const std::size_t repetitions = best.repetitions().count();
  const auto hits = [&](double share) {
    return percent(static_cast<std::size_t>(std::lround(share * static_cast<double>(repetitions))),
                   repetitions);
  };
  Table shown{.head = {"statement of the paper", "holds as seen", "holds in truth",
                       "sets of the search\nwith it"},
              .rows = {}};
  for (std::size_t i = 0; i < outcome.study.statements.size(); ++i) {
    const auto with =
        std::count_if(outcome.together.begin(), outcome.together.end(),
                      [i](const ExplainedPoint& p) { return p.repetitions.share(i) >= kHalf; });
    shown.rows.push_back({fmt::format("{}. {}", i + 1, outcome.study.statements[i].text),
                          hits(best.repetitions().share(i)), hits(best.repetitions().true_share(i)),
                          percent(static_cast<std::size_t>(with), outcome.together.size())});
  }
  return table(shown, "Statements with the best set");
}

// For every statement the one that it meets least: which hold together.
Html together_table(const ExplainOutcome& outcome) {
  const std::size_t count = outcome.study.statements.size();
  Table shown{.head = {"no.", "met least with no.", "sets with both", "with the rarer one"},
              .rows = {}};
  const auto sets_with = [&](std::size_t i, std::size_t j) {
    return std::count_if(
        outcome.together.begin(), outcome.together.end(), [&](const ExplainedPoint& p) {
          return p.repetitions.share(i) >= kHalf && p.repetitions.share(j) >= kHalf;
        });
  };
  for (std::size_t i = 0; i < count; ++i) {
    double least = 2.0;
    std::vector<std::string> row;
    for (std::size_t j = 0; j < count; ++j) {
      const auto rarer = std::min(sets_with(i, i), sets_with(j, j));
      if (j == i || rarer == 0) continue;
      const double share = static_cast<double>(sets_with(i, j)) / static_cast<double>(rarer);
      if (share >= least) continue;
      least = share;
      row = {fmt::format("{}", i + 1), fmt::format("{}", j + 1), fmt::format("{}", sets_with(i, j)),
             fmt::format("{}", rarer)};
    }
    if (!row.empty()) shown.rows.push_back(std::move(row));
  }
  return table(shown, "Statements that hold together");
}

// How good the best set is with each level of each factor.
Html levels_table(const ExplainOutcome& outcome) {
  Table shown{.head = {"with", "statements, best set with it", "of them typical"}, .rows = {}};
  for (std::size_t f = 0; f < outcome.study.factors.size(); ++f) {
    const Factor& factor = outcome.study.factors[f];
    if (!factor.combined) continue;
    for (std::size_t l = 0; l < factor.levels.size(); ++l) {
      const auto best =
          std::find_if(outcome.together.begin(), outcome.together.end(),
                       [&](const ExplainedPoint& point) { return point.levels[f] == l; });
      shown.rows.push_back({factor.title + ": " + factor.levels[l].label,
                            fmt::format("{:.1f}", best->repetitions.mean_held()),
                            fmt::format("{}", typical(best->repetitions))});
    }
  }
  return table(shown, "Best set with each value");
}

Html confirmed_table(const ExplainOutcome& outcome) {
  const std::size_t all = outcome.study.statements.size();
  Table shown{.head = {"set", "statements, mean:\nestimate", "prediction", "afterwards",
                       fmt::format("all {}", all), fmt::format("{} or more", all - 1)},
              .rows = {}};
  for (const ConfirmedSet& one : outcome.confirmed) {
    std::vector<std::string>& row = shown.rows.emplace_back();
    row.push_back(one.label);
    for (const ReadResult& read : one.readings) {
      row.push_back(fmt::format("{:.1f}", read.repetitions.mean_held()));
    }
    for (const std::size_t held : {all, all - 1}) {
      row.push_back(percent(one.repetitions().with_at_least(held), one.repetitions().count()));
    }
  }
  return table(shown, "Sets with many repetitions");
}

Html excess_table(const ExplainOutcome& outcome) {
  Table shown{.head = {"set", "estimate", "prediction", "afterwards", "truth", "lag of the bench",
                       "lag found"},
              .rows = {}};
  for (const ConfirmedSet& one : outcome.confirmed) {
    std::vector<std::string>& row = shown.rows.emplace_back();
    row.push_back(one.label);
    for (const ReadResult& read : one.readings) row.push_back(spread(read.over_K));
    row.insert(row.end(), {spread(one.over_true_K), fmt::format("{:g}", one.true_lag),
                           spread(one.found_lags)});
  }
  return table(shown, "Excess and lag");
}

std::string label_of(const Explanation& study, const std::string& id) {
  return std::find_if(study.runs.begin(), study.runs.end(),
                      [&id](const StudyRun& run) { return run.id == id; })
      ->label;
}

const Factor& scanned(const Explanation& study) {
  return *std::find_if(study.factors.begin(), study.factors.end(),
                       [&](const Factor& f) { return f.id == study.scan_factor; });
}

void add_scan_line(const std::vector<ScanPoint>& points, const Series& style,
                   std::vector<Panel>& panels) {
  Series held = style;
  Series dip = style;
  dip.legend.clear();
  Series seen = dip;
  Series truth = dip;
  seen.dash = Dash::kSolid;
  truth.dash = Dash::kDotted;
  for (const ScanPoint& point : points) {
    for (Series* one : {&held, &dip, &seen, &truth}) one->x.push_back(point.value);
    held.y.push_back(point.mean_held);
    dip.y.push_back(point.dip_percent);
    seen.y.push_back(point.over_estimate_K);
    truth.y.push_back(point.over_true_K);
  }
  panels[0].series.push_back(std::move(held));
  panels[1].series.push_back(std::move(dip));
  panels[2].series.push_back(std::move(seen));
  panels[2].series.push_back(std::move(truth));
}

std::vector<Figure> scan_figures(const ExplainOutcome& outcome) {
  std::vector<Figure> figures;
  const auto statements = static_cast<double>(outcome.study.statements.size());
  for (std::size_t s = 0; s < outcome.scans.size(); ++s) {
    const Factor& factor = scanned(outcome.study);
    std::vector<Panel> panels(3);
    panels[0] = {.title = fmt::format("Statements that hold, of {:g}", statements),
                 .y_min = 0.0,
                 .y_max = statements};
    panels[1] = {.title = "Undershoot of the estimated absorption in %",
                 .levels = {{.label = "5 %", .y = 5.0, .dash = Dash::kDotted}}};
    panels[2] = {.title = "R2 = 5e4 over the limit in K (dotted: truth)",
                 .levels = {{.label = "the paper: about 2 K", .y = 2.0, .dash = Dash::kDotted}}};
    for (std::size_t l = 0; l < outcome.scans[s].size(); ++l) {
      add_scan_line(outcome.scans[s][l],
                    {.legend = factor.title + " " + factor.levels[l].label,
                     .ink = static_cast<Ink>(l % 6),
                     .dash = static_cast<Dash>(l % 4)},
                    panels);
    }
    const Scan& scan = outcome.study.scans[s];
    figures.push_back({.description = scan.title + ": statements that hold, undershoot, excess",
                       .x_label = scan.title + ", periods",
                       .x_min = scan.values.front(),
                       .x_max = scan.values.back(),
                       .panels = std::move(panels)});
  }
  return figures;
}

Figure lag_figure(const ExplainOutcome& outcome) {
  Panel misfit{.title = "Mean squared innovation in its variance", .y_min = 0.0};
  misfit.levels = {{.label = "1: what the filter believes", .y = 1.0, .dash = Dash::kDotted}};
  for (const bool on_lagged : {true, false}) {
    if (!on_lagged && outcome.confirmed.size() == 1) break;
    const ConfirmedSet& one = on_lagged ? outcome.confirmed.front() : outcome.confirmed.back();
    misfit.series.push_back({.legend = fmt::format("bench with a lag of {:g}", one.true_lag),
                             .x = outcome.study.lags,
                             .y = one.lag_misfit,
                             .ink = on_lagged ? Ink::kSeries1 : Ink::kSeries2,
                             .dash = on_lagged ? Dash::kSolid : Dash::kDashed});
  }
  return {.description = "Misfit of a filter over the lag that it is told",
          .x_label = "lag that the filter is told, periods",
          .x_min = outcome.study.lags.front(),
          .x_max = outcome.study.lags.back(),
          .panels = {std::move(misfit)}};
}

Html lag_section(const ExplainOutcome& outcome) {
  const ConfirmedSet& best = outcome.confirmed.front();
  Table shown{.head = {"what the controller does", "over the limit", "highest true peak",
                       "highest estimate", "held from the reference", "95 % after, median"},
              .rows = {}};
  for (const Remedy& one : outcome.remedies) {
    shown.rows.push_back({one.label, percent(one.over, best.found_lags.size()),
                          number_text(one.true_K, "K"), number_text(one.estimate_K, "K"),
                          number_text(one.held_K, "K"), number_text(one.time_to_95_ms, "ms")});
  }
  return section(
      "What a controller should do about an unknown lag",
      element("p", fmt::format("One treatment ({}) tells the lag: its "
                               "record is replayed through filters that are told one lag each, and "
                               "the least misfit is taken. Found on this bench: {}; true: {:g}.",
                               label_of(outcome.study, outcome.study.lag_run),
                               spread(best.found_lags), best.true_lag)) +
          side_by_side({lag_figure(outcome)}) +
          element("p", "The best set's bench in closed loop:") + table(shown, "Remedies"));
}

Html best_loops(const ExplainOutcome& outcome) {
  std::vector<Figure> figures;
  for (const double target : {30.0, 10.0}) {
    std::vector<OverlayCurve> curves;
    for (const RunResult& run : outcome.confirmed.front().runs) {
      if (run.config.control.peak_reference != target) continue;
      const auto n = static_cast<int>(curves.size());
      curves.push_back(overlay_curve(label_of(outcome.study, run.id), run));
      curves.back().ink = static_cast<Ink>(n);
      curves.back().dash = static_cast<Dash>(n);
    }
    if (curves.empty()) continue;
    figures.push_back(overlay_figure(curves, {.end_ms = 120.0, .estimate = true}));
  }
  return section("The best set as the paper draws it", side_by_side(figures));
}

std::string verdict_of(const ExplainOutcome& outcome) {
  const std::size_t all = outcome.study.statements.size();
  const auto complete =
      std::count_if(outcome.together.begin(), outcome.together.end(),
                    [&](const ExplainedPoint& p) { return typical(p.repetitions) == all; });
  std::size_t alone = 0;
  for (const ExplainedPoint& point : outcome.alone) {
    alone = std::max(alone, typical(point.repetitions));
  }
  const ConfirmedSet& best = outcome.confirmed.front();
  return fmt::format(
      "With the defaults {} of the paper's {} statements are typical (they hold in half of "
      "the repetitions), with one thing changed at best {}; of {} combinations {} make all of them "
      "typical. Repeated with other seeds, the best set shows {:.1f} statements in the mean of a "
      "repetition, and all {} in {} of {}. It is a candidate, not a measurement: the paper gives "
      "no data to fit, the thresholds are ours, and the best of many sets is chosen by the "
      "statements that it then explains.",
      typical(outcome.alone.front().repetitions), all, alone, outcome.together.size(), complete,
      best.repetitions().mean_held(), all, best.repetitions().with_at_least(all),
      best.repetitions().count());
}

}  // namespace

void write_explanation(const std::filesystem::path& folder, const ExplainOutcome& outcome) {
  const Explanation& study = outcome.study;
  const PageHead head{.title = study.title,
                      .kicker = "what explains the experiments",
                      .line = Html(verdict_of(outcome)),
                      .notice = "Simulated eyes. " + study.note,
                      .css = kCss};
  const std::vector<Figure> scans = scan_figures(outcome);
  Html body =
      section("The paper's statements, with the best set",
              element("p", element("strong", outcome.confirmed.front().label)) +
                  statements_table(outcome)) +
      best_loops(outcome) +
      section("Best sets and candidates, repeated with other seeds",
              element("p",
                      "What can be read as the peak of an experiment: the filter's estimate after "
                      "each sample (used everywhere else on this page), its prediction before it, "
                      "or, afterwards, the model under the recorded powers with the last alpha.") +
                  confirmed_table(outcome) +
                  element("p",
                          "R2 = 5e4 over the limit, in K: median and middle 95 % of the "
                          "repetitions. Lags in periods, beyond what the estimator is told.") +
                  excess_table(outcome)) +
      section("What is needed", levels_table(outcome));
  if (!scans.empty()) {
    body += section(
        "Sensitivity to the lag",
        element("p", "The best set, but for the lag and the transmission.") + side_by_side(scans));
  }
  body += lag_section(outcome) +
          section("The best of all combinations",
                  points_table(study, outcome.together, outcome.alone.front(), kShownSets,
                               "Best sets")) +
          section("One thing changed, the rest as by default",
                  points_table(study, outcome.alone, outcome.alone.front(), outcome.alone.size(),
                               "One change")) +
          section("One thing of the best set changed",
                  points_table(study, outcome.around, outcome.around.front(), outcome.around.size(),
                               "Around the best")) +
          section("Which statements hold together", together_table(outcome)) +
          element("section",
                  unfold(Html("The search's file"), read_file(study.file.string(), 1'000'000)));
  std::filesystem::create_directories(folder);
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const std::string name = fmt::format("sensitivity-{}", s + 1);
    write_file((folder / (name + ".svg")).string(), figure_svg(scans[s], SvgKind::kStandAlone));
    write_file((folder / (name + ".csv")).string(), figure_csv(scans[s]));
  }
  write_file((folder / "sets.csv").string(), sets_csv(outcome));
  write_file((folder / "explanation.json").string(), explanation_json(outcome));
  write_file((folder / "index.html").string(), page(head, body));
}

}  // namespace photocoag
