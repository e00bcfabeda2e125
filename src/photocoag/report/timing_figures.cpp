#include "photocoag/report/timing_figures.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "photocoag/report/page.hpp"

namespace photocoag {
namespace {

constexpr std::int64_t kMostColumns = 80;
constexpr std::size_t kFewestColumns = 10;  // so that a single bin is no block across the panel
constexpr double kFloor = 0.5;              // a count of 1 is seen above it

struct Columns {
  std::int64_t width = 1, start = 0, count = 0;  // in bins
};

Columns columns_of(const RunSummary::Histogram& histogram) {
  const std::int64_t last = histogram.bins.back().first;
  Columns columns{.start = histogram.bins.front().first};
  if (columns.start <= last - columns.start) columns.start = 0;  // 0 is not far: show it
  std::int64_t power = 1;
  while ((last - columns.start) / columns.width >= kMostColumns) {
    const std::int64_t leading = columns.width / power;
    if (leading == 5) power *= 10;
    columns.width = leading == 1 ? 2 * power : leading == 2 ? 5 * power : power;
  }
  columns.start -= columns.start % columns.width;
  columns.count = (last - columns.start) / columns.width + 1;
  return columns;
}

std::string outside(const RunSummary::Histogram& histogram) {
  std::string words;
  if (histogram.below_0 > 0) words += fmt::format("; {} below 0", histogram.below_0);
  if (histogram.overflow > 0) words += fmt::format("; {} above all bins", histogram.overflow);
  return words;
}

Figure timing_figure(const RunSummary::Histogram& histogram) {
  const Columns columns = columns_of(histogram);
  std::vector<std::int64_t> counts(static_cast<std::size_t>(columns.count));
  for (const auto& [edge, entries] : histogram.bins)
    counts[static_cast<std::size_t>((edge - columns.start) / columns.width)] += entries;

  auto [name, unit] = page_detail::name_and_unit(histogram.name);
  if (!name.empty() && name[0] >= 'a' && name[0] <= 'z')
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
  const auto edge_of = [&columns](std::size_t k) {
    return static_cast<double>(columns.start + static_cast<std::int64_t>(k) * columns.width);
  };
  Series bars{.legend = {}, .x = {edge_of(0)}, .y = {0.0}, .mark = Mark::kBars, .width = 1.2};
  for (std::size_t k = 0; k < counts.size(); ++k) {
    bars.x.push_back(edge_of(k + 1));
    bars.y.push_back(static_cast<double>(counts[k]));
  }

  const std::size_t fullest =
      static_cast<std::size_t>(std::max_element(counts.begin(), counts.end()) - counts.begin());
  Panel panel{.title = fmt::format("{}: cycles per {}{}{}", name, columns.width,
                                   unit.empty() ? "" : " " + unit, outside(histogram)),
              .y_min = kFloor,
              .y_log = true};
  panel.series.push_back(std::move(bars));
  return {
      .description = fmt::format("{}, logarithmic. From {:g} to {:g} {}, most ({}) from {:g} to "
                                 "{:g} {}.",
                                 panel.title, edge_of(0), edge_of(counts.size()), unit,
                                 counts[fullest], edge_of(fullest), edge_of(fullest + 1), unit),
      .x_label = unit,
      // An empty column at either end, so that the outer ones are seen to end.
      .x_min = columns.start > 0 ? edge_of(0) - static_cast<double>(columns.width) : 0.0,
      .x_max = edge_of(std::max(counts.size() + 1, kFewestColumns)),
      .panels = {std::move(panel)},
      .panel_height = 200.0};
}

}  // namespace

std::vector<Figure> timing_figures(const std::vector<RunSummary::Histogram>& histograms) {
  std::vector<Figure> figures;
  for (const RunSummary::Histogram& histogram : histograms)
    if (!histogram.bins.empty()) figures.push_back(timing_figure(histogram));
  return figures;
}

}  // namespace photocoag
