#include "photocoag/page/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

using Out = std::back_insert_iterator<std::string>;

void append_value(std::string& csv, double value) {
  csv += ',';
  if (std::isfinite(value)) fmt::format_to(Out(csv), "{}", value);
}

// A CSV field in quotes if it has to be.
std::string field(std::string_view text) {
  if (text.find_first_of(",\"\n\r") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

}  // namespace

std::string figure_csv(const Figure& figure) {
  std::string csv = "panel,curve,x,y,low,high\n";
  for (const Panel& panel : figure.panels) {
    const auto begin_row = [&](std::string_view curve, double x) {
      csv += field(panel.title) + ',' + field(curve);
      append_value(csv, x);
    };
    for (const Series& series : panel.series)
      for (std::size_t k = 0; k < series.x.size(); ++k) {
        begin_row(series.legend, series.x[k]);
        append_value(csv, series.y[k]);
        csv += ",,\n";
      }
    for (const Band& band : panel.bands)
      for (std::size_t k = 0; k < band.x.size(); ++k) {
        begin_row(band.legend, band.x[k]);
        csv += ',';
        append_value(csv, band.low[k]);
        append_value(csv, band.high[k]);
        csv += '\n';
      }
    for (const Level& level : panel.levels)
      for (const double x : {figure.x_min, figure.x_max}) {
        begin_row(level.label, x);
        append_value(csv, level.y);
        csv += ",,\n";
      }
  }
  return csv;
}

bool has_values(const std::vector<double>& values) noexcept {
  return std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

std::vector<double> with_start(const std::vector<double>& values, double start) {
  std::vector<double> all = {start};
  all.insert(all.end(), values.begin(), values.end());
  return all;
}

Series decimate(const Series& series, std::size_t max_points) {
  const std::size_t count = series.x.size();
  if (count <= max_points || count < 3) return series;
  const std::size_t bins = std::max<std::size_t>(1, max_points / 2);
  std::vector<std::size_t> kept = {0};
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const std::size_t begin = bin * count / bins;
    const std::size_t end = (bin + 1) * count / bins;
    std::size_t lowest = end, highest = end, gap = end;
    for (std::size_t k = begin; k < end; ++k) {
      if (!std::isfinite(series.y[k])) {
        gap = std::min(gap, k);
        continue;
      }
      if (lowest == end || series.y[k] < series.y[lowest]) lowest = k;
      if (highest == end || series.y[k] > series.y[highest]) highest = k;
    }
    for (const std::size_t k : {lowest, highest, gap})
      if (k != end) kept.push_back(k);
  }
  kept.push_back(count - 1);
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  Series result = series;
  result.x.clear();
  result.y.clear();
  for (const std::size_t k : kept) {
    result.x.push_back(series.x[k]);
    result.y.push_back(series.y[k]);
  }
  return result;
}

Band decimate(const Band& band, std::size_t max_points) {
  const std::size_t count = band.x.size();
  if (count <= max_points || count < 3) return band;
  const std::size_t bins = std::max<std::size_t>(1, max_points);
  Band result{.legend = band.legend, .x = {}, .low = {}, .high = {}, .ink = band.ink};
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const std::size_t begin = bin * count / bins;
    const std::size_t end = (bin + 1) * count / bins;
    double low = INFINITY, high = -INFINITY;
    for (std::size_t k = begin; k < end; ++k) {
      if (band.low[k] < low) low = band.low[k];  // false for NaN
      if (band.high[k] > high) high = band.high[k];
    }
    const bool empty = !(low <= high);
    const bool last = bin + 1 == bins;
    result.x.push_back(band.x[last ? end - 1 : begin]);
    result.low.push_back(empty ? std::numeric_limits<double>::quiet_NaN() : low);
    result.high.push_back(empty ? std::numeric_limits<double>::quiet_NaN() : high);
  }
  return result;
}

}  // namespace photocoag
