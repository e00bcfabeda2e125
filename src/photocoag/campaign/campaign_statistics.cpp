#include "photocoag/campaign/campaign_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "photocoag/campaign/table_statistics.hpp"
#include "photocoag/population/statistics.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kBins = 60;

// Columns: outcomes, then the outcomes of kHistograms, then inputs.
std::vector<RowColumn> all_columns(const SpotRows& rows) {
  std::vector<RowColumn> columns;
  for (const OutcomeColumn& outcome : outcome_columns()) {
    columns.push_back(outcome_column(outcome.name, rows.inputs));
  }
  for (const HistogramOf& one : kHistograms) {
    columns.push_back(outcome_column(one.outcome, rows.inputs));
    columns.back().log10 = one.log10;
  }
  for (std::size_t i = 0; i < rows.inputs; ++i) columns.push_back(input_column(i));
  return columns;
}

Histogram empty_histogram(double low, double high, std::uint64_t values) {
  if (high > low) return {.low = low, .high = high, .percent = std::vector<double>(kBins)};
  low = values == 0 ? 0.0 : low - 0.5;
  return {.low = low, .high = low + 1.0, .percent = std::vector<double>(kBins)};
}

void count_in(Histogram& histogram, double value, std::uint64_t values) {
  if (!std::isfinite(value)) return;
  const double width = (histogram.high - histogram.low) / static_cast<double>(kBins);
  const double bin =
      std::clamp((value - histogram.low) / width, 0.0, static_cast<double>(kBins - 1));
  histogram.percent[static_cast<std::size_t>(bin)] += 100.0 / static_cast<double>(values);
}

// The highest values so far, highest first; of equal ones the first.
class Worst {
 public:
  void see(double value, const double* block, std::size_t inputs) {
    if (values_.size() == CampaignStatistics::kWorst && !(value > values_.back())) return;
    const auto at = std::find_if(values_.begin(), values_.end(),
                                 [value](double other) { return value > other; });
    spots_.insert(spots_.begin() + (at - values_.begin()), from_block(block, inputs));
    values_.insert(at, value);
    if (values_.size() <= CampaignStatistics::kWorst) return;
    values_.pop_back();
    spots_.pop_back();
  }
  std::vector<SpotRecord>& spots() noexcept { return spots_; }

 private:
  std::vector<double> values_;
  std::vector<SpotRecord> spots_;
};

}  // namespace

CampaignSummary summarize_campaign(const SpotRows& rows) {
  CampaignSummary summary{.spots = rows.count};
  const auto column = [&rows](std::string_view name) { return outcome_column(name, rows.inputs); };
  const RowColumn over = column("over_limit_K");
  const RowColumn time = column("time_to_95_ms");
  const RowColumn stopped = column("stopped");
  const RowColumn peak = column("peak_max_K");
  summary.peak_max_K = std::numeric_limits<double>::quiet_NaN();
  rows.for_each([&](const double* block) {
    summary.violations += over.of(block) > 0.0 ? 1 : 0;
    summary.never_reached += std::isfinite(time.of(block)) ? 0 : 1;
    summary.stopped += stopped.of(block) > 0.0 ? 1 : 0;
    const double value = peak.of(block);
    if (std::isfinite(value) && !(value <= summary.peak_max_K)) summary.peak_max_K = value;
  });
  if (rows.count > 0) {
    summary.probability =
        static_cast<double>(summary.violations) / static_cast<double>(summary.spots);
    std::tie(summary.probability_low, summary.probability_high) =
        binomial_interval(summary.violations, summary.spots);
  }
  const std::vector<ColumnMoments> held =
      moments(rows, {column("held_mean_error_K"), column("held_half_error_K")});
  summary.held_mean_K = held[0].mean;
  summary.held_deviation_K = held[0].deviation;
  summary.half_mean_K = held[1].mean;
  summary.half_deviation_K = held[1].deviation;
  return summary;
}

CampaignStatistics campaign_statistics(const SpotRows& rows, const std::filesystem::path& folder,
                                       std::size_t in_memory) {
  CampaignStatistics all;
  all.summary = summarize_campaign(rows);
  const RowColumn peak = outcome_column("over_limit_K", rows.inputs);
  const std::vector<RowColumn> columns = all_columns(rows);
  const std::size_t outcomes = outcome_columns().size();
  const std::size_t inputs = outcomes + kHistograms.size();
  const std::vector<ColumnMoments> of = moments(rows, columns);

  std::vector<double> fractions = {0.001, 0.999, 1.0 - CampaignStatistics::kTail};
  const auto listed = static_cast<std::ptrdiff_t>(fractions.size());
  fractions.insert(fractions.end(), OutcomeStatistics::kFractions.begin(),
                   OutcomeStatistics::kFractions.end());
  const auto found = quantiles(
      rows, {columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(inputs)}, fractions);
  for (std::size_t i = 0; i < outcomes; ++i) {
    all.outcomes.push_back({.mean = of[i].mean,
                            .deviation = of[i].deviation,
                            .quantiles = {found[i].begin() + listed, found[i].end()}});
  }
  for (std::size_t i = outcomes; i < inputs; ++i) {
    all.histograms.push_back(empty_histogram(found[i][0], found[i][1], of[i].count));
  }

  const double threshold = found[outcome_index("over_limit_K")][2];
  std::vector<double> tail(rows.inputs, 0.0);
  double tail_count = 0.0;
  Worst worst;
  rows.for_each([&](const double* block) {
    for (std::size_t i = outcomes; i < inputs; ++i) {
      count_in(all.histograms[i - outcomes], columns[i].of(block), of[i].count);
    }
    worst.see(peak.of(block), block, rows.inputs);
    if (!(peak.of(block) >= threshold)) return;
    for (std::size_t i = 0; i < rows.inputs; ++i) tail[i] += columns[inputs + i].of(block);
    tail_count += 1.0;
  });
  all.worst = std::move(worst.spots());

  const std::vector<double> correlations = rank_correlations(
      rows, {columns.begin() + static_cast<std::ptrdiff_t>(inputs), columns.end()}, peak, folder,
      in_memory);
  for (std::size_t i = 0; i < rows.inputs; ++i) {
    all.inputs.push_back({.mean = of[inputs + i].mean,
                          .deviation = of[inputs + i].deviation,
                          .rank_correlation = correlations[i],
                          .tail_mean = tail[i] / tail_count});
  }
  return all;
}

double statistics_bytes(double rows) noexcept {
  // Of an input and of the peak's ranks, one pair each at a time.
  return rows > static_cast<double>(PairSorter::kInMemory) ? 2.0 * sizeof(KeyedValue) * rows : 0.0;
}

}  // namespace photocoag
