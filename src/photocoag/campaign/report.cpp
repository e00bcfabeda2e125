#include "photocoag/campaign/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "photocoag/core/build_info.hpp"
#include "photocoag/page/page.hpp"

namespace photocoag {
namespace {

using Statistics = CampaignStatistics;

constexpr std::size_t kMedian = 1;  // of OutcomeStatistics::kFractions

Figure histogram(const std::string& title, const std::string& x_label, const Histogram& of) {
  Series bars{.x = {of.low}, .y = {0.0}, .mark = Mark::kBars, .width = 1.2};
  const double width = (of.high - of.low) / static_cast<double>(of.percent.size());
  for (std::size_t i = 0; i < of.percent.size(); ++i) {
    bars.x.push_back(of.low + width * static_cast<double>(i + 1));
    bars.y.push_back(of.percent[i]);
  }
  return {
      .description = title + ": share of the spots",
      .x_label = x_label,
      .x_min = of.low,
      .x_max = of.high,
      .panels = {Panel{.title = title + ", % of spots", .series = {std::move(bars)}, .y_min = 0.0}},
      .panel_height = 220.0};
}

std::vector<Figure> histograms(const std::vector<Histogram>& of) {
  // In the order of kHistograms.
  return {histogram("Overshoot", "highest true peak over the reference, K", of[0]),
          histogram("Time to 95 %", "ms", of[1]),
          histogram("Held temperature", "mean of true peak minus reference after 50 ms, K", of[2]),
          histogram("Steadiness", "standard deviation of the true peak after 50 ms, K", of[3]),
          histogram("Error of the absorption factor", "final estimate over truth - 1, %", of[4]),
          histogram("Thermal dose, visible lesion (Schlott 2012)",
                    "log10 of the Arrhenius integral", of[5]),
          histogram("Thermal dose, damage (Welch and Polhamus)", "log10 of the Arrhenius integral",
                    of[6])};
}

Table outcome_table(const Statistics& statistics) {
  Table table{
      .head = {"outcome", "unit", "mean", "st. dev.", "1 %", "median", "99 %", "99.9 %", "largest"},
      .rows = {}};
  for (std::size_t i = 0; i < outcome_columns().size(); ++i) {
    const OutcomeColumn& outcome = outcome_columns()[i];
    const OutcomeStatistics& of = statistics.outcomes[i];
    std::vector<std::string> row{std::string(outcome.name), std::string(outcome.unit),
                                 number_text(of.mean, ""), number_text(of.deviation, "")};
    for (const double value : of.quantiles) row.push_back(number_text(value, ""));
    table.rows.push_back(std::move(row));
  }
  return table;
}

// Sorted by how far the inputs of the spots with the highest peaks are from the rest.
Table input_table(const Campaign& campaign, const Statistics& statistics) {
  std::vector<std::pair<double, std::vector<std::string>>> rows;
  for (std::size_t i = 0; i < campaign.inputs.size(); ++i) {
    const InputStatistics& of = statistics.inputs[i];
    const double shift = of.deviation > 0.0 ? (of.tail_mean - of.mean) / of.deviation : 0.0;
    const std::string& key = campaign.inputs[i].key;
    rows.push_back({std::abs(shift),
                    {key, std::string(input_unit(key)), number_text(of.mean, ""),
                     number_text(of.deviation, ""), fmt::format("{:+.2f}", of.rank_correlation),
                     number_text(of.tail_mean, ""), fmt::format("{:+.2f}", shift)}});
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  Table table{.head = {"input", "unit", "mean", "st. dev.", "rank correlation", "mean in the tail",
                       "shift, st. dev."},
              .rows = {}};
  for (auto& [shift, row] : rows) table.rows.push_back(std::move(row));
  return table;
}

Html worst_section(const Campaign& campaign, const Statistics& statistics,
                   const std::string& replay) {
  Table worst{
      .head = {"spot", "highest peak, K", "over the limit, K", "cycles over", "error of alpha, %"},
      .rows = {}};
  for (const RandomQuantity& input : campaign.inputs) worst.head.push_back(short_name(input.key));
  std::string commands;
  for (const SpotRecord& spot : statistics.worst) {
    auto& row = worst.rows.emplace_back();
    row.push_back(fmt::format("{}", spot.spot));
    for (const std::string_view name :
         {"peak_max_K", "over_limit_K", "over_limit_cycles", "absorption_error_percent"})
      row.push_back(number_text(spot.outcomes[outcome_index(name)], ""));
    for (const double input : spot.inputs) row.push_back(number_text(input, ""));
    commands += fmt::format("{} {}\n", replay, spot.spot);
  }
  return section("The ten worst spots",
                 element("p.hint",
                         "By the highest true peak. Each command replays its spot to the "
                         "bit and leaves a run folder with a report.") +
                     table(worst, "The ten worst spots") +
                     element("pre.command", element("code", commands)));
}

Html first_numbers(const Statistics& statistics) {
  const CampaignSummary& summary = statistics.summary;
  const auto percent = [](double probability) {
    return fmt::format("{:.3g} %", 100.0 * probability);
  };
  return tiles(
      {{"Violation probability", percent(summary.probability),
        fmt::format("95 % interval {} to {}, exact binomial", percent(summary.probability_low),
                    percent(summary.probability_high))},
       {"Held temperature",
        fmt::format("{} ± {}", number_text(summary.held_mean_K, ""),
                    number_text(summary.held_deviation_K, "K")),
        "minus reference, over the spots; -0.04 ± 0.98 °C measured in rabbits by the best "
        "published "
        "system (von der Burchard et al.)"},
       {"Time to 95 %",
        number_text(statistics.outcomes[outcome_index("time_to_95_ms")].quantiles[kMedian], "ms"),
        fmt::format("median; never in {} spots; {} stopped by the supervisor",
                    summary.never_reached, summary.stopped)},
       {"Error of alpha",
        number_text(statistics.outcomes[outcome_index("absorption_error_percent")].deviation, "%"),
        "standard deviation at the end"}});
}

}  // namespace

std::string as_markdown(const Table& table) {
  const auto line = [](const std::vector<std::string>& cells) {
    return fmt::format("| {} |\n", fmt::join(cells, " | "));
  };
  std::string text = line(table.head) + line(std::vector<std::string>(table.head.size(), "---"));
  for (const auto& row : table.rows) text += line(row);
  return text;
}

std::string campaign_json(const Campaign& campaign, const CampaignSummary& summary) {
  const auto number = [](double value) {
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
  };
  const double count = static_cast<double>(summary.spots);
  const nlohmann::ordered_json json = {
      {"notice", kResearchNotice},
      {"spots", summary.spots},
      {"spots_wanted", campaign.spots},
      {"seed", campaign.seed},
      {"over_limit_spots", summary.violations},
      {"over_limit_probability", summary.probability},
      {"over_limit_probability_low", summary.probability_low},
      {"over_limit_probability_high", summary.probability_high},
      {"held_mean_error_K", number(summary.held_mean_K)},
      {"held_std_error_K", number(summary.held_deviation_K)},
      {"held_half_mean_error_K", number(summary.half_mean_K)},
      {"held_half_std_error_K", number(summary.half_deviation_K)},
      {"reached_95_percent", number((count - static_cast<double>(summary.never_reached)) / count)},
      {"stopped_spots", summary.stopped},
      {"peak_max_K", number(summary.peak_max_K)},
      {"peak_reference_K", campaign.config.control.peak_reference},
      {"limit_K", campaign.config.control.peak_max},
      {"campaign", std::filesystem::path(campaign.file).filename().string()},
      {"config_sha256", config_sha256(campaign.config)},
      {"version", version()}};
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string campaign_page(const Campaign& campaign, const Statistics& statistics,
                          std::size_t full_order_states, const std::string& replay) {
  const CampaignSummary& summary = statistics.summary;
  const bool full = campaign.config.plant.model == PlantModel::kFull;
  const PageHead head{
      .title = fmt::format("Limit exceeded in {} of {} spots", summary.violations, summary.spots),
      .kicker = "campaign",
      .line = fmt::format(
          "{} · seed {} · {} · {} eye, {:g} ms per cycle", campaign.file, campaign.seed,
          campaign.spots == summary.spots
              ? "complete"
              : fmt::format("INTERRUPTED: {} spots wanted", campaign.spots),
          full ? fmt::format("full-order ({} states)", full_order_states) : std::string("reduced"),
          campaign.config.control.period * 1e3),
      .notice = "Virtual spots: the result covers only the variation of the random inputs."};
  const Html body =
      first_numbers(statistics) +
      section("Distributions",
              element("div.columns.count-1", stack(histograms(statistics.histograms))) +
                  element("p.hint",
                          "Each from the 0.1 % to the 99.9 % quantile; what lies outside "
                          "is in the outer bins.")) +
      worst_section(campaign, statistics, replay) +
      section(
          "Which inputs drive the risk",
          element("p.hint",
                  fmt::format("Rank correlation of each input with the highest peak over all "
                              "spots, and how far its mean among the {:g} % of spots with the "
                              "highest peaks is from its mean over all, in standard deviations. "
                              "Sorted by the latter.",
                              100.0 * Statistics::kTail)) +
              table(input_table(campaign, statistics), "Inputs")) +
      section("Outcomes", table(outcome_table(statistics), "Outcomes")) +
      element("section", {unfold("Campaign file", campaign.text),
                          unfold("Configuration", to_toml(campaign.config))});
  return page(head, body);
}

std::string campaign_markdown(const Campaign& campaign, const Statistics& statistics,
                              std::size_t full_order_states) {
  const CampaignSummary& summary = statistics.summary;
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
      as_markdown(outcome_table(statistics)), 100.0 * Statistics::kTail,
      as_markdown(input_table(campaign, statistics)));
}

}  // namespace photocoag
