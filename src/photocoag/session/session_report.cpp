#include "photocoag/session/session_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "photocoag/page/page.hpp"
#include "photocoag/population/statistics.hpp"
#include "photocoag/session/session_map.hpp"
#include "photocoag/session/session_record.hpp"

namespace photocoag {
namespace {

using Value = double AttemptOutcome::*;

// Completed attempts in order: the data of distributions and drift.
std::vector<AttemptOutcome> treated(const SessionResult& result) {
  std::vector<AttemptOutcome> list;
  for (const AttemptOutcome& attempt : result.attempts) {
    if (is_complete(attempt.ending)) list.push_back(attempt);
  }
  return list;
}

std::vector<double> column(const std::vector<AttemptOutcome>& spots, Value value) {
  std::vector<double> values;
  for (const AttemptOutcome& spot : spots) values.push_back(spot.*value);
  return values;
}

// The share of spots at or below a value.
Figure distribution(const std::string& title, const std::string& unit, std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  std::sort(values.begin(), values.end());
  double low = values.empty() ? 0.0 : values.front();
  double high = values.empty() ? 1.0 : values.back();
  const double margin = std::max(0.05 * (high - low), 1e-3 * std::max(1.0, std::abs(high)));
  low -= margin;
  high += margin;
  Series steps{.x = {low}, .y = {0.0}, .mark = Mark::kSteps};
  for (std::size_t k = 0; k < values.size(); ++k) {
    // A step holds from the value before to its own: the share is that below it.
    steps.x.push_back(values[k]);
    steps.y.push_back(100.0 * static_cast<double>(k) / static_cast<double>(values.size()));
  }
  steps.x.push_back(high);
  steps.y.push_back(values.empty() ? 0.0 : 100.0);
  return {.description = title + ": share of the spots at or below a value",
          .x_label = unit,
          .x_min = low,
          .x_max = high,
          .panels = {Panel{.title = title + ": % of spots below",
                           .series = {std::move(steps)},
                           .y_min = 0.0,
                           .y_max = 100.0}},
          .panel_height = 200.0};
}

std::vector<Figure> distributions(const std::vector<AttemptOutcome>& spots) {
  const bool truth = has_values(column(spots, &AttemptOutcome::peak_true_max_K));
  return {distribution(truth ? "True peak" : "Estimated peak", "K",
                       column(spots, truth ? &AttemptOutcome::peak_true_max_K
                                           : &AttemptOutcome::peak_estimate_max_K)),
          distribution("Time to 95 %", "ms", column(spots, &AttemptOutcome::time_to_95_ms)),
          distribution("Held minus reference", "K", column(spots, &AttemptOutcome::held_error_K)),
          distribution("Energy", "mJ", column(spots, &AttemptOutcome::energy_mJ))};
}

Band band(const std::string& legend, const std::vector<double>& x,
          const std::vector<double>& middle, const std::vector<double>& sigma, Ink ink) {
  Band made{.legend = legend, .x = x, .low = {}, .high = {}, .ink = ink};
  for (std::size_t k = 0; k < x.size(); ++k) {
    made.low.push_back(middle[k] - 2.0 * sigma[k]);
    made.high.push_back(middle[k] + 2.0 * sigma[k]);
  }
  return made;
}

Series dots(const std::string& legend, const std::vector<double>& x, std::vector<double> y,
            Ink ink) {
  return {
      .legend = legend, .x = x, .y = std::move(y), .ink = ink, .mark = Mark::kPoints, .width = 5.0};
}

std::vector<Figure> drift(const std::vector<AttemptOutcome>& spots) {
  std::vector<double> x;
  for (std::size_t k = 0; k < spots.size(); ++k) x.push_back(static_cast<double>(k + 1));
  const auto of = [&](Value value) { return column(spots, value); };
  Panel alpha{
      .title = "Absorption factor",
      .bands = {band("prior ± 2σ", x, of(&AttemptOutcome::prior), of(&AttemptOutcome::prior_sigma),
                     Ink::kMuted)},
      .series = {dots("final estimate", x, of(&AttemptOutcome::absorption), Ink::kSeries2)}};
  Panel residual{.title = "Residual of the volume temperature in K",
                 .bands = {band("± 2 standard errors", x, of(&AttemptOutcome::residual_K),
                                of(&AttemptOutcome::residual_sigma_K), Ink::kSeries1)},
                 .series = {dots("measured minus estimated", x, of(&AttemptOutcome::residual_K),
                                 Ink::kSeries1)},
                 .levels = {Level{.y = 0.0}}};
  const auto figure = [&](const std::string& description, Panel panel) {
    return Figure{.description = description + " in the order of the spots",
                  .x_label = "spot, in the order of treatment",
                  .x_min = 0.5,
                  .x_max = std::max(1.5, static_cast<double>(spots.size()) + 0.5),
                  .panels = {std::move(panel)}};
  };
  std::vector<Figure> figures = {figure("Absorption", std::move(alpha)),
                                 figure("Residual", std::move(residual))};
  if (has_values(of(&AttemptOutcome::power_ratio))) {
    figures.push_back(
        figure("Power",
               Panel{.title = "Emitted over commanded power",
                     .series = {dots("ratio", x, of(&AttemptOutcome::power_ratio), Ink::kSeries3)},
                     .levels = {Level{.y = 1.0}}}));
  }
  return figures;
}

// A straight line through the values in their order: its slope and the slope's standard error.
std::pair<double, double> slope(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  if (values.size() < 3) return {kNotKnown, kNotKnown};
  double mean = 0.0;
  for (const double value : values) mean += value / n;
  const double middle = 0.5 * (n - 1.0);
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const double x = static_cast<double>(k) - middle;
    xx += x * x;
    xy += x * (values[k] - mean);
    yy += (values[k] - mean) * (values[k] - mean);
  }
  const double found = xy / xx;
  return {found, std::sqrt(std::max(0.0, yy - found * xy) / (n - 2.0) / xx)};
}

Table drift_table(const std::vector<AttemptOutcome>& spots) {
  Table table{.head = {"quantity", "mean", "st. dev.", "drift per spot", "standard error",
                       "rank correlation\nwith the order"},
              .rows = {}};
  const auto row = [&](const std::string& name, Value value) {
    std::vector<double> values = column(spots, value);
    std::erase_if(values, [](double v) { return !std::isfinite(v); });
    if (values.empty()) return;
    std::vector<double> order;
    for (std::size_t k = 0; k < values.size(); ++k) order.push_back(static_cast<double>(k));
    const auto [mean, deviation] = mean_and_deviation(values);
    const auto [per_spot, error] = slope(values);
    table.rows.push_back({name, number_text(mean, ""), number_text(deviation, ""),
                          number_text(per_spot, ""), number_text(error, ""),
                          values.size() < 3
                              ? std::string("none")
                              : fmt::format("{:+.2f}", rank_correlation(order, values))});
  };
  row("absorption factor", &AttemptOutcome::absorption);
  row("measured minus estimated volume temperature, K", &AttemptOutcome::residual_K);
  row("emitted over commanded power", &AttemptOutcome::power_ratio);
  return table;
}

std::string plus_minus(double value, double sigma) {
  return std::isnan(value) ? std::string("none") : fmt::format("{:.3f} ± {:.3f}", value, sigma);
}

Html attempts_table(const Session& session, const SessionResult& result) {
  Html head, body;
  for (const char* cell :
       {"spot", "attempt", "outcome", "reference\nK", "highest peak\nK", "95 % after\nms",
        "held minus\nreference, K", "absorption\nfactor", "prior", "energy\nmJ"}) {
    const bool words = std::string_view(cell) == "outcome";
    head += element(words ? "th.words" : "th", cell, {{"scope", "col"}});
  }
  for (const AttemptOutcome& a : result.attempts) {
    const Config& config = session.configs[session.find(a.spot, session.file)];
    const bool truth = std::isfinite(a.peak_true_max_K);
    Html cells = element("td", element("a", a.spot, {{"href", a.folder + "/report.html"}}));
    cells += element("td", fmt::format("{}", a.attempt));
    Html outcome = ending_mark(a.ending) + Html(" ") + Html(words_of(a.ending));
    if (!a.why.empty()) outcome += element("small", a.why);
    cells += element("td.words", outcome);
    for (const std::string& text :
         {number_text(config.control.peak_reference, ""),
          number_text(truth ? a.peak_true_max_K : a.peak_estimate_max_K, ""),
          number_text(a.time_to_95_ms, ""), number_text(a.held_error_K, ""),
          plus_minus(a.absorption, a.absorption_sigma), plus_minus(a.prior, a.prior_sigma),
          number_text(a.energy_mJ, "")}) {
      cells += element("td", text);
    }
    body += element("tr", cells);
  }
  return scroll(
      element("table.data", {element("thead", element("tr", head)), element("tbody", body)}),
      "Every attempt");
}

Html first_numbers(const Session& session, const SessionTotals& totals,
                   const std::vector<AttemptOutcome>& spots) {
  const double limit = session.limits.energy * 1e3;
  return tiles(
      {{"Treated", fmt::format("{} of {}", totals.treated, totals.spots),
        fmt::format("{} over the limit, {} stopped", totals.over_limit, totals.stopped)},
       {"May have emitted", fmt::format("{}", totals.uncertain),
        "begun, but the program ended early: repeated only on request"},
       {"Energy", number_text(totals.energy_mJ, "mJ"),
        std::isfinite(limit) ? fmt::format("of {:g} mJ for the session", limit)
                             : std::string("no limit for the session")},
       {"Absorption factor", plus_minus(totals.absorption_mean, totals.absorption_deviation),
        fmt::format(
            "mean and standard deviation over the spots; 95 % after {} in the median",
            number_text(quantile(column(spots, &AttemptOutcome::time_to_95_ms), 0.5), "ms"))}});
}

std::string title_of(const SessionTotals& totals, const SessionResult& result) {
  std::string title = fmt::format("{} of {} spots treated", totals.treated, totals.spots);
  const auto add = [&](std::size_t count, std::string_view words) {
    if (count > 0) title += fmt::format(", {} {}", count, words);
  };
  add(totals.over_limit, "over the limit");
  add(totals.stopped, "stopped");
  add(totals.uncertain, "may have emitted");
  return result.end == SessionEnd::kComplete ? title : title + ": not complete";
}

}  // namespace

std::string session_page(const Session& session, const SessionResult& result) {
  const SessionTotals totals = totals_of(result);
  const std::vector<AttemptOutcome> spots = treated(result);
  const PageHead head{
      .title = title_of(totals, result),
      .kicker = "session",
      .line = fmt::format("{} · {} · seed {}{}", session.title,
                          session.device.empty() ? "simulated eye" : session.device, session.seed,
                          session.learn ? " · earlier spots are the next one's prior" : ""),
      .css = map_css()};
  Html body;
  if (!result.why.empty()) body += element("p.warning", "Ended early: " + result.why);
  body += first_numbers(session, totals, spots);
  body += section("Map", session_map(session, result) + map_legend(result));
  if (!spots.empty()) {
    body +=
        section("Distributions", element("div.columns.count-1", stack(distributions(spots))) +
                                     element("p.hint", "Of the attempts that went to their end."));
    body += section(
        "Drift",
        element("div.columns.count-1", stack(drift(spots))) +
            element("p.hint",
                    "A thermometer or a laser whose calibration drifts shows as absorption that "
                    "drifts with the order of the spots: the two cannot be told apart by one "
                    "spot. What neither explains stays in the residual.") +
            table(drift_table(spots), "Drift"));
  }
  body += section("Spots", attempts_table(session, result));
  body += element("section", {unfold("Session file", session.text)});
  return page(head, body);
}

}  // namespace photocoag
