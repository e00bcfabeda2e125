#include "photocoag/study/sweep.hpp"

#include <fmt/format.h>

#include <cmath>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/page/page.hpp"
#include "photocoag/run/claimed_folder.hpp"
#include "photocoag/study/overlay.hpp"

namespace photocoag {
namespace {

using Out = std::back_insert_iterator<std::string>;

constexpr std::size_t kMostCombinations = 10'000;

std::string label_of(const std::vector<Varied>& varied, const SweepPoint& point) {
  std::string label;
  for (std::size_t i = 0; i < varied.size(); ++i) {
    const std::string& key = varied[i].key;
    label += fmt::format("{}{} = {}", i == 0 ? "" : ", ", key.substr(key.rfind('.') + 1),
                         point.values[i]);
  }
  return label;
}

double cell(const SweepPoint& point, const std::pair<std::string, std::string>& column) {
  return statistic_of(column.second, point.result.measures.at(column.first));
}

}  // namespace

Varied parse_varied(const std::string& option) {
  const std::size_t equals = option.find('=');
  const auto refuse = [&](std::string problem) {
    throw Error(ErrorParts{.where = "--vary " + option,
                           .problem = std::move(problem),
                           .accepted = "key=value1,value2,…"});
  };
  if (equals == std::string::npos || equals == 0) refuse("no key");
  Varied varied{option.substr(0, equals), {}};
  int depth = 0;
  char quote = '\0';
  std::string value;
  for (const char c : option.substr(equals + 1) + ",") {
    if (quote != '\0') {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    } else if (c == ',' && depth == 0) {
      if (value.empty()) refuse("an empty value");
      varied.values.push_back(std::move(value));
      value.clear();
      continue;
    }
    value += c;
  }
  if (!value.empty()) refuse("a bracket or quote is not closed");
  return varied;
}

std::vector<SweepPoint> sweep(const std::string& config, const std::vector<std::string>& set,
                              const std::vector<Varied>& varied, int seeds, bool use_cache,
                              const Progress& progress) {
  std::size_t total = 1;
  for (const Varied& one : varied) total *= one.values.size();
  if (total > kMostCombinations) {
    throw Error(ErrorParts{.where = "--vary",
                           .found = fmt::format("{} combinations", total),
                           .accepted = fmt::format("at most {}", kMostCombinations)});
  }
  std::vector<SweepPoint> points(total);
  std::vector<RunJob> jobs;
  for (std::size_t k = 0; k < total; ++k) {
    std::size_t rest = k;
    points[k].values.resize(varied.size());
    for (std::size_t i = varied.size(); i-- > 0;) {
      points[k].values[i] = varied[i].values[rest % varied[i].values.size()];
      rest /= varied[i].values.size();
    }
    std::vector<std::string> overrides = set;
    for (std::size_t i = 0; i < varied.size(); ++i) {
      overrides.push_back(varied[i].key + "=" + points[k].values[i]);
    }
    jobs.push_back({std::to_string(k), load_config(config, overrides)});
  }
  ModelPool pool(use_cache);
  std::vector<RunResult> results = run_all(jobs, seeds, pool, progress);
  for (std::size_t k = 0; k < total; ++k) points[k].result = std::move(results[k]);
  return points;
}

const std::vector<std::pair<std::string, std::string>>& sweep_columns() {
  static const std::vector<std::pair<std::string, std::string>> columns = {
      {"peak_max_K", "max"},
      {"over_limit_cycles", "max"},
      {"time_to_95_ms", "median"},
      {"settled_ms", "median"},
      {"late_rms_error_K", "max"},
      {"power_max_mW", "max"},
      {"saturated_cycles", "median"},
      {"absorption_final_error_percent", "max"},
      {"absorption_settled_ms", "median"}};
  return columns;
}

void write_sweep(const std::filesystem::path& folder, const std::vector<Varied>& varied,
                 const std::vector<SweepPoint>& points, int seeds) {
  check_run_folder(folder);
  std::vector<std::string> keys;
  for (const Varied& one : varied) keys.push_back(one.key);
  Table shown{.head = keys, .rows = {}};
  for (const auto& [measure, statistic] : sweep_columns()) {
    keys.push_back(statistic + "_" + measure);
    shown.head.push_back(measure + ", " + statistic);
  }
  std::string csv = fmt::format("{}\n", fmt::join(keys, ","));
  std::vector<OverlayCurve> curves;
  for (const SweepPoint& point : points) {
    auto& row = shown.rows.emplace_back(point.values);
    std::vector<std::string> cells;
    for (const std::string& value : point.values)
      cells.push_back(value.find(',') == std::string::npos ? value : "\"" + value + "\"");
    for (const auto& column : sweep_columns()) {
      const double value = cell(point, column);
      cells.push_back(std::isfinite(value) ? fmt::format("{}", value) : "");
      row.push_back(number_text(value, unit_of(column.first)));
    }
    fmt::format_to(Out(csv), "{}\n", fmt::join(cells, ","));
    curves.push_back(overlay_curve(label_of(varied, point), point.result));
  }
  const std::vector<Figure> figures = overlay_figures(curves);
  const PageHead head{
      .title = "Sweep",
      .kicker = "sweep",
      .line = fmt::format("{} combinations, {} noise seeds each", points.size(), seeds),
      .notice = "Simulated eye. The table is over the seeds; the first seed is drawn."};
  const Html body =
      section(curves.size() > kMostCurves ? fmt::format("Overlay, the first {}", kMostCurves)
                                          : "Overlay",
              stack(figures)) +
      section("Table", table(shown, "Measures of the combinations")) +
      element("section", unfold("Configuration of the first combination",
                                to_toml(points.front().result.config)));
  std::filesystem::create_directories(folder);
  write_file((folder / "sweep.csv").string(), csv);
  write_file((folder / "sweep.svg").string(), figure_svg(figures.front(), SvgKind::kStandAlone));
  write_file((folder / "index.html").string(), page(head, body));
}

}  // namespace photocoag
