#include "photocoag/campaign/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <tuple>

#include "photocoag/campaign/results_file.hpp"
#include "photocoag/campaign/statistics.hpp"
#include "photocoag/report/html.hpp"
#include "photocoag/report/plot.hpp"
#include "photocoag/study/page_frame.hpp"

namespace photocoag {
namespace {

using Out = std::back_insert_iterator<std::string>;

constexpr std::size_t kWorst = 10;
constexpr std::size_t kBins = 60;
constexpr double kTail = 0.01;  // the share of spots with the highest peaks

std::vector<double> column(const std::vector<SpotRecord>& spots, std::string_view name) {
  const std::size_t index = outcome_index(name);
  std::vector<double> values;
  for (const SpotRecord& spot : spots) values.push_back(spot.outcomes[index]);
  return values;
}

std::vector<double> input_column(const std::vector<SpotRecord>& spots, std::size_t index) {
  std::vector<double> values;
  for (const SpotRecord& spot : spots) values.push_back(spot.inputs[index]);
  return values;
}

// Share of the spots per bin, from the 0.1 % to the 99.9 % quantile; what lies outside is in the
// outer bins.
Figure histogram(const std::string& title, const std::string& x_label, std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  double low = quantile(values, 0.001);
  double high = quantile(values, 0.999);
  if (!(high > low)) {
    low = values.empty() ? 0.0 : low - 0.5;
    high = low + 1.0;
  }
  std::vector<double> share(kBins, 0.0);
  const double width = (high - low) / static_cast<double>(kBins);
  for (const double v : values) {
    const double bin = std::clamp((v - low) / width, 0.0, static_cast<double>(kBins - 1));
    share[static_cast<std::size_t>(bin)] += 100.0 / static_cast<double>(values.size());
  }
  Series bars{.ink = Ink::kSeries1, .mark = Mark::kSteps};
  bars.x.push_back(low);
  bars.y.push_back(0.0);
  for (std::size_t i = 0; i < kBins; ++i) {
    bars.x.push_back(low + width * static_cast<double>(i + 1));
    bars.y.push_back(share[i]);
  }
  return {
      .description = title + ": share of the spots",
      .x_label = x_label,
      .x_min = low,
      .x_max = high,
      .panels = {Panel{.title = title + ", % of spots", .series = {std::move(bars)}, .y_min = 0.0}},
      .width = 520.0,
      .panel_height = 220.0};
}

std::vector<Figure> histograms(const std::vector<SpotRecord>& spots) {
  std::vector<double> dose[2] = {column(spots, "dose_schlott_2012"),
                                 column(spots, "dose_welch_polhamus")};
  for (auto& values : dose) {
    for (double& v : values) v = std::log10(v);
  }
  return {histogram("Overshoot", "highest true peak over the reference, K",
                    column(spots, "overshoot_K")),
          histogram("Time to 95 %", "ms", column(spots, "time_to_95_ms")),
          histogram("Held temperature", "mean of true peak minus reference after 50 ms, K",
                    column(spots, "held_mean_error_K")),
          histogram("Steadiness", "standard deviation of the true peak after 50 ms, K",
                    column(spots, "held_std_K")),
          histogram("Error of the absorption factor", "final estimate over truth - 1, %",
                    column(spots, "absorption_error_percent")),
          histogram("Thermal dose, visible lesion (Schlott 2012)",
                    "log10 of the Arrhenius integral", dose[0]),
          histogram("Thermal dose, damage (Welch and Polhamus)", "log10 of the Arrhenius integral",
                    dose[1])};
}

// A table before it is HTML or Markdown.
struct Table {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};

std::string as_html(const Table& table) {
  std::string html = "<div class=\"scroll\"><table class=\"data\"><thead><tr>";
  for (const std::string& cell : table.head) html += "<th>" + escape_html(cell) + "</th>";
  html += "</tr></thead>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + escape_html(cell) + "</td>";
    html += "</tr>\n";
  }
  return html + "</table></div>";
}

std::string as_markdown(const Table& table) {
  const auto line = [](const std::vector<std::string>& cells) {
    return fmt::format("| {} |\n", fmt::join(cells, " | "));
  };
  std::string text = line(table.head) + line(std::vector<std::string>(table.head.size(), "---"));
  for (const auto& row : table.rows) text += line(row);
  return text;
}

Table outcome_table(const std::vector<SpotRecord>& spots) {
  Table table{
      .head = {"outcome", "unit", "mean", "st. dev.", "1 %", "median", "99 %", "99.9 %", "largest"},
      .rows = {}};
  for (const OutcomeColumn& outcome : outcome_columns()) {
    const std::vector<double> values = column(spots, outcome.name);
    const auto [mean, deviation] = mean_and_deviation(values);
    std::vector<std::string> row{std::string(outcome.name), std::string(outcome.unit)};
    for (const double value :
         {mean, deviation, quantile(values, 0.01), quantile(values, 0.5), quantile(values, 0.99),
          quantile(values, 0.999), quantile(values, 1.0)}) {
      row.push_back(number_text(value, ""));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

// Sorted by how far the inputs of the spots with the highest peaks are from the rest.
Table input_table(const Campaign& campaign, const std::vector<SpotRecord>& spots) {
  const std::vector<double> peak = column(spots, "over_limit_K");
  const double threshold = quantile(peak, 1.0 - kTail);
  std::vector<std::pair<double, std::vector<std::string>>> rows;
  for (std::size_t i = 0; i < campaign.inputs.size(); ++i) {
    const std::vector<double> values = input_column(spots, i);
    std::vector<double> tail;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (peak[k] >= threshold) tail.push_back(values[k]);
    }
    const auto [mean, deviation] = mean_and_deviation(values);
    const double tail_mean = mean_and_deviation(tail).first;
    const double shift = deviation > 0.0 ? (tail_mean - mean) / deviation : 0.0;
    const std::string& key = campaign.inputs[i].key;
    rows.push_back(
        {std::abs(shift),
         {key, std::string(input_unit(key)), number_text(mean, ""), number_text(deviation, ""),
          fmt::format("{:+.2f}", rank_correlation(values, peak)), number_text(tail_mean, ""),
          fmt::format("{:+.2f}", shift)}});
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  Table table{.head = {"input", "unit", "mean", "st. dev.", "rank correlation", "mean in the tail",
                       "shift, st. dev."},
              .rows = {}};
  for (auto& [shift, row] : rows) table.rows.push_back(std::move(row));
  return table;
}

std::string worst_table(const Campaign& campaign, const std::vector<SpotRecord>& spots,
                        const std::string& replay) {
  const std::size_t over = outcome_index("over_limit_K");
  std::vector<std::size_t> order(spots.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return spots[a].outcomes[over] > spots[b].outcomes[over];
  });
  order.resize(std::min(order.size(), kWorst));
  std::string html =
      "<section><h2>The ten worst spots</h2>\n<p class=\"hint\">By the highest true peak. Each "
      "command replays its spot to the bit and leaves a run folder with a report.</p>\n<div "
      "class=\"scroll\"><table class=\"data\"><thead><tr><th>spot</th><th>highest peak, "
      "K</th><th>over the limit, K</th><th>cycles over</th><th>error of alpha, %</th>";
  for (const CampaignInput& input : campaign.inputs) {
    fmt::format_to(Out(html), "<th>{}</th>", escape_html(short_name(input.key)));
  }
  html += "</tr></thead>\n";
  std::string commands;
  for (const std::size_t k : order) {
    const SpotRecord& spot = spots[k];
    const auto value = [&spot](std::string_view name) {
      return number_text(spot.outcomes[outcome_index(name)], "");
    };
    fmt::format_to(Out(html), "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                   spot.spot, value("peak_max_K"), value("over_limit_K"),
                   value("over_limit_cycles"), value("absorption_error_percent"));
    for (const double input : spot.inputs) {
      fmt::format_to(Out(html), "<td>{}</td>", number_text(input, ""));
    }
    html += "</tr>\n";
    commands += fmt::format("{} {}\n", replay, spot.spot);
  }
  return html + "</table></div>\n<pre class=\"command\"><code>" + escape_html(commands) +
         "</code></pre></section>\n";
}

}  // namespace

CampaignSummary summarize_campaign(const std::vector<SpotRecord>& spots) {
  CampaignSummary summary{.spots = spots.size()};
  for (const double over : column(spots, "over_limit_K")) summary.violations += over > 0.0 ? 1 : 0;
  for (const double time : column(spots, "time_to_95_ms")) {
    summary.never_reached += std::isfinite(time) ? 0 : 1;
  }
  if (!spots.empty()) {
    summary.probability =
        static_cast<double>(summary.violations) / static_cast<double>(summary.spots);
    std::tie(summary.probability_low, summary.probability_high) =
        binomial_interval(summary.violations, summary.spots);
  }
  for (const double stopped : column(spots, "stopped")) summary.stopped += stopped > 0.0 ? 1 : 0;
  std::tie(summary.held_mean_K, summary.held_deviation_K) =
      mean_and_deviation(column(spots, "held_mean_error_K"));
  return summary;
}

std::string campaign_page(const Campaign& campaign, const std::vector<SpotRecord>& spots,
                          std::size_t full_order_states, const std::string& replay) {
  const CampaignSummary summary = summarize_campaign(spots);
  const auto percent = [](double probability) {
    return fmt::format("{:.3g} %", 100.0 * probability);
  };
  std::string html = page_begin(
      fmt::format("Limit exceeded in {} of {} spots", summary.violations, summary.spots),
      "campaign",
      fmt::format("{} · seed {} · {} · {} eye, {:g} ms per cycle", campaign.file, campaign.seed,
                  campaign.spots == summary.spots
                      ? "complete"
                      : fmt::format("INTERRUPTED: {} spots wanted", campaign.spots),
                  campaign.config.plant.model == PlantModel::kFull
                      ? fmt::format("full-order ({} states)", full_order_states)
                      : std::string("reduced"),
                  campaign.config.control.period * 1e3),
      "Virtual spots: what the random inputs leave out, the result leaves out.",
      ".command{margin-top:14px}\n");
  html += "<dl class=\"tiles\">\n";
  html +=
      page_tile("Violation probability", percent(summary.probability),
                fmt::format("95 % interval {} to {}, exact binomial",
                            percent(summary.probability_low), percent(summary.probability_high)));
  html += page_tile("Held temperature",
                    fmt::format("{} ± {}", number_text(summary.held_mean_K, ""),
                                number_text(summary.held_deviation_K, "K")),
                    "minus reference, over the spots; -0.04 ± 0.98 °C measured in rabbits by the "
                    "best published system (von der Burchard et al.)");
  html +=
      page_tile("Time to 95 %", number_text(quantile(column(spots, "time_to_95_ms"), 0.5), "ms"),
                fmt::format("median; never in {} spots; {} stopped by the supervisor",
                            summary.never_reached, summary.stopped));
  html += page_tile(
      "Error of alpha",
      number_text(mean_and_deviation(column(spots, "absorption_error_percent")).second, "%"),
      "standard deviation at the end");
  html += "</dl>\n<section><h2>Distributions</h2>\n<div class=\"columns count-2\">\n";
  const std::vector<Figure> figures = histograms(spots);
  for (const std::string& svg : render_figures(figures, SvgKind::kInline)) {
    html += "<figure>" + svg + "</figure>\n";
  }
  html +=
      "</div><p class=\"hint\">Each from the 0.1 % to the 99.9 % quantile; what lies outside is in "
      "the outer bins.</p></section>\n";
  html += worst_table(campaign, spots, replay);
  html += fmt::format(
      "<section><h2>Which inputs drive the risk</h2>\n<p class=\"hint\">Rank correlation of each "
      "input with the highest peak over all spots, and how far its mean among the {:g} % of spots "
      "with the highest peaks is from its mean over all, in standard deviations. Sorted by the "
      "latter.</p>\n{}</section>\n<section><h2>Outcomes</h2>{}</section>\n",
      100.0 * kTail, as_html(input_table(campaign, spots)), as_html(outcome_table(spots)));
  fmt::format_to(Out(html),
                 "<section><details><summary>Campaign file</summary><pre "
                 "class=\"config\"><code>{}</code></pre></details>\n<details><summary>"
                 "Configuration</summary><pre class=\"config\"><code>{}</code></pre></details>"
                 "</section>\n",
                 escape_html(campaign.text), escape_html(to_toml(campaign.config)));
  return html + page_end();
}

std::string campaign_markdown(const Campaign& campaign, const std::vector<SpotRecord>& spots,
                              std::size_t full_order_states) {
  const CampaignSummary summary = summarize_campaign(spots);
  return fmt::format(
      "{} spots, {}; the limit is exceeded in {}: {:.3g} %, 95 % interval {:.3g} to {:.3g} %. Held "
      "temperature {:+.3f} ± {:.3f} K from the reference; {} spots never reach 95 % of it; {} are "
      "stopped by the supervisor{}.\n\n{}\nInputs that drive the tail (the {:g} % of spots with "
      "the "
      "highest peaks):\n\n{}",
      summary.spots,
      campaign.config.plant.model == PlantModel::kFull
          ? fmt::format("full-order eyes of {} states", full_order_states)
          : std::string("reduced eyes"),
      summary.violations, 100.0 * summary.probability, 100.0 * summary.probability_low,
      100.0 * summary.probability_high, summary.held_mean_K, summary.held_deviation_K,
      summary.never_reached, summary.stopped,
      campaign.config.safety.supervised ? "" : " (there is none)",
      as_markdown(outcome_table(spots)), 100.0 * kTail, as_markdown(input_table(campaign, spots)));
}

}  // namespace photocoag
