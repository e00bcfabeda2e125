#include "photocoag/campaign/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <tuple>

#include "photocoag/campaign/statistics.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/page/page.hpp"

namespace photocoag {
namespace {

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
  Series bars{.x = {low}, .y = {0.0}, .mark = Mark::kBars, .width = 1.2};
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

Html worst_section(const Campaign& campaign, const std::vector<SpotRecord>& spots,
                   const std::string& replay) {
  const std::size_t over = outcome_index("over_limit_K");
  std::vector<std::size_t> order(spots.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return spots[a].outcomes[over] > spots[b].outcomes[over];
  });
  order.resize(std::min(order.size(), kWorst));
  Table worst{
      .head = {"spot", "highest peak, K", "over the limit, K", "cycles over", "error of alpha, %"},
      .rows = {}};
  for (const RandomQuantity& input : campaign.inputs) worst.head.push_back(short_name(input.key));
  std::string commands;
  for (const std::size_t k : order) {
    const SpotRecord& spot = spots[k];
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

Html first_numbers(const CampaignSummary& summary, const std::vector<SpotRecord>& spots) {
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
       {"Time to 95 %", number_text(quantile(column(spots, "time_to_95_ms"), 0.5), "ms"),
        fmt::format("median; never in {} spots; {} stopped by the supervisor",
                    summary.never_reached, summary.stopped)},
       {"Error of alpha",
        number_text(mean_and_deviation(column(spots, "absorption_error_percent")).second, "%"),
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
  std::tie(summary.half_mean_K, summary.half_deviation_K) =
      mean_and_deviation(column(spots, "held_half_error_K"));
  summary.peak_max_K = quantile(column(spots, "peak_max_K"), 1.0);
  return summary;
}

std::string campaign_json(const Campaign& campaign, const std::vector<SpotRecord>& spots) {
  const CampaignSummary summary = summarize_campaign(spots);
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

std::string campaign_page(const Campaign& campaign, const std::vector<SpotRecord>& spots,
                          std::size_t full_order_states, const std::string& replay) {
  const CampaignSummary summary = summarize_campaign(spots);
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
      .notice = "Virtual spots: what the random inputs leave out, the result leaves out."};
  const Html body =
      first_numbers(summary, spots) +
      section("Distributions",
              element("div.columns.count-1", stack(histograms(spots))) +
                  element("p.hint",
                          "Each from the 0.1 % to the 99.9 % quantile; what lies outside "
                          "is in the outer bins.")) +
      worst_section(campaign, spots, replay) +
      section(
          "Which inputs drive the risk",
          element("p.hint",
                  fmt::format("Rank correlation of each input with the highest peak over all "
                              "spots, and how far its mean among the {:g} % of spots with the "
                              "highest peaks is from its mean over all, in standard deviations. "
                              "Sorted by the latter.",
                              100.0 * kTail)) +
              table(input_table(campaign, spots), "Inputs")) +
      section("Outcomes", table(outcome_table(spots), "Outcomes")) +
      element("section", {unfold("Campaign file", campaign.text),
                          unfold("Configuration", to_toml(campaign.config))});
  return page(head, body);
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
