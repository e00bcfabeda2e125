#include "photocoag/campaign/pareto.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "photocoag/campaign/report.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/population/statistics.hpp"
#include "photocoag/run/run_folder.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostBytes = 1'000'000;
constexpr const char* kBoundFile = "offline-bound.json";

const Json& value_of(const Json& json, const std::string& file, const char* key, bool is_text) {
  const auto found = json.find(key);
  const bool good = found != json.end() &&
                    (is_text ? found->is_string() : found->is_number() || found->is_null());
  if (good) return *found;
  throw Error(ErrorParts{.where = file,
                         .key = key,
                         .found = found == json.end() ? "nothing" : found->dump(),
                         .accepted = is_text ? "text" : "a number"});
}

double number_of(const Json& json, const std::string& file, const char* key) {
  const Json& value = value_of(json, file, key, false);
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

std::string percent(double probability) { return fmt::format("{:.3g}", 100.0 * probability); }

// Below any of the probabilities: where 0 is drawn, %.
double floor_of(const std::vector<ParetoPoint>& points) {
  double lowest = 100.0;
  for (const ParetoPoint& point : points) {
    lowest = std::min(lowest, 100.0 / static_cast<double>(std::max<std::uint64_t>(1, point.spots)));
  }
  return std::pow(10.0, std::floor(std::log10(0.5 * lowest)));
}

Ink ink_of(std::size_t index) {
  constexpr Ink kInks[] = {Ink::kSeries1, Ink::kSeries2, Ink::kSeries3,
                           Ink::kSeries4, Ink::kSeries5, Ink::kSeries6};
  return kInks[index % std::size(kInks)];
}

Json read_object(const std::string& file) {
  const Json json =
      Json::parse(read_file(file, kMostBytes, "summary of a campaign"), nullptr, false);
  if (!json.is_object()) throw Error(ErrorParts{.where = file, .problem = "not a JSON object"});
  return json;
}

std::string name_of(const fs::path& folder) {
  const fs::path path = folder.lexically_normal();
  return (path.filename().empty() ? path.parent_path() : path).filename().string();
}

// What a batch estimate of the whole record would hold, one point per probability.
std::vector<ParetoPoint> read_bounds(const fs::path& folder) {
  const std::string file = (folder / kBoundFile).string();
  const Json json = read_object(file);
  const auto points = json.find("points");
  if (points == json.end() || !points->is_array()) {
    throw Error(ErrorParts{.where = file, .key = "points", .accepted = "an array"});
  }
  std::vector<ParetoPoint> all;
  for (const Json& one : *points) {
    const auto number = [&](const char* key) { return number_of(one, file, key); };
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    ParetoPoint point;
    point.campaign = value_of(json, file, "campaign", true).get<std::string>();
    point.half_mean = point.reached = point.peak_max = kNone;
    point.is_bound = true;
    point.name = fmt::format("{}, {} %", name_of(folder), percent(number("limit_probability")));
    point.spots = static_cast<std::uint64_t>(number_of(json, file, "spots"));
    point.violations = static_cast<std::uint64_t>(number("over_limit_spots"));
    point.probability = static_cast<double>(point.violations) /
                        static_cast<double>(std::max<std::uint64_t>(1, point.spots));
    std::tie(point.probability_low, point.probability_high) =
        binomial_interval(point.violations, point.spots);
    point.held_mean = number("held_mean_error_K");
    point.held_deviation = number("held_std_error_K");
    point.peak_reference = number_of(json, file, "peak_reference_K");
    point.limit = number_of(json, file, "limit_K");
    all.push_back(std::move(point));
  }
  return all;
}

// The held peak itself, so that references may differ.
double held_peak(const ParetoPoint& point) { return point.peak_reference + point.held_mean; }

}  // namespace

bool is_campaign_folder(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / "campaign.h5", ignored) || fs::exists(folder / kBoundFile, ignored);
}

ParetoPoint read_pareto_point(const fs::path& folder) {
  const std::string file = (folder / "summary.json").string();
  const Json json = read_object(file);
  const auto number = [&](const char* key) { return number_of(json, file, key); };
  const auto count = [&](const char* key) { return static_cast<std::uint64_t>(number(key)); };
  ParetoPoint point;
  point.name = name_of(folder);
  point.campaign = value_of(json, file, "campaign", true).get<std::string>();
  point.spots = count("spots");
  point.violations = count("over_limit_spots");
  point.probability = number("over_limit_probability");
  point.probability_low = number("over_limit_probability_low");
  point.probability_high = number("over_limit_probability_high");
  point.held_mean = number("held_mean_error_K");
  point.held_deviation = number("held_std_error_K");
  point.half_mean = number("held_half_mean_error_K");
  point.reached = number("reached_95_percent");
  point.stopped = count("stopped_spots");
  point.peak_max = number("peak_max_K");
  point.peak_reference = number("peak_reference_K");
  point.limit = number("limit_K");
  return point;
}

std::vector<std::size_t> pareto_front(const std::vector<ParetoPoint>& points) {
  std::vector<std::size_t> front;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].is_bound || !std::isfinite(held_peak(points[i]))) continue;
    const bool beaten = std::any_of(points.begin(), points.end(), [&](const ParetoPoint& other) {
      if (other.is_bound) return false;
      const bool no_worse =
          held_peak(other) >= held_peak(points[i]) && other.probability <= points[i].probability;
      const bool better =
          held_peak(other) > held_peak(points[i]) || other.probability < points[i].probability;
      return no_worse && better;
    });
    if (!beaten) front.push_back(i);
  }
  std::sort(front.begin(), front.end(), [&](std::size_t a, std::size_t b) {
    return held_peak(points[a]) < held_peak(points[b]);
  });
  return front;
}

Figure pareto_figure(const std::vector<ParetoPoint>& points) {
  const double floor = floor_of(points);
  const auto drawn = [floor](double probability) { return std::max(floor, 100.0 * probability); };
  Panel panel{.title = "Eyes with the true peak over the limit, % (bars: 95 % interval)",
              .y_min = floor,
              .y_max = 100.0,
              .y_log = true};
  Series line{.legend = "not beaten in both", .ink = Ink::kMuted, .dash = Dash::kDotted};
  for (const std::size_t i : pareto_front(points)) {
    line.x.push_back(held_peak(points[i]));
    line.y.push_back(drawn(points[i].probability));
  }
  panel.series.push_back(std::move(line));
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  Series bound{
      .legend = "if the record were known before", .ink = Ink::kMuted, .dash = Dash::kDashed};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ParetoPoint& point = points[i];
    const double x = held_peak(point);
    if (!std::isfinite(x)) continue;
    low = std::min(low, x);
    high = std::max(high, x);
    if (point.is_bound) {
      bound.x.push_back(x);
      bound.y.push_back(drawn(point.probability));
      continue;
    }
    panel.series.push_back({.x = {x, x},
                            .y = {drawn(point.probability_low), drawn(point.probability_high)},
                            .ink = ink_of(i),
                            .width = 1.2});
    panel.series.push_back({.legend = point.name,
                            .x = {x},
                            .y = {drawn(point.probability)},
                            .ink = ink_of(i),
                            .mark = Mark::kPoints,
                            .width = 8.0});
  }
  if (!bound.x.empty()) panel.series.push_back(std::move(bound));
  if (!(low <= high)) low = high = points.empty() ? 0.0 : points.front().peak_reference;
  const double room = std::max(0.25, 0.05 * (high - low));
  return {.description = "Share of the eyes over the limit against the held peak temperature",
          .x_label = "held peak temperature rise after 50 ms, mean over the eyes, in K",
          .x_min = low - room,
          .x_max = high + room,
          .panels = {std::move(panel)},
          .panel_height = 320.0};
}

Table pareto_table(const std::vector<ParetoPoint>& points) {
  Table result{.head = {"campaign", "eyes", "over the limit", "%", "95 % interval, %",
                        "held minus reference, K", "st. dev., K", "second half, K",
                        "95 % reached, % of eyes", "stopped", "highest peak, K", "reference, K"},
               .rows = {}};
  for (const ParetoPoint& p : points) {
    result.rows.push_back(
        {p.name, fmt::format("{}", p.spots), fmt::format("{}", p.violations),
         percent(p.probability),
         fmt::format("{} to {}", percent(p.probability_low), percent(p.probability_high)),
         fmt::format("{:+.3f}", p.held_mean), fmt::format("{:.3f}", p.held_deviation),
         p.is_bound ? "" : fmt::format("{:+.3f}", p.half_mean),
         p.is_bound ? "" : fmt::format("{:.1f}", 100.0 * p.reached), fmt::format("{}", p.stopped),
         p.is_bound ? "" : fmt::format("{:.2f}", p.peak_max),
         fmt::format("{:g}", p.peak_reference)});
  }
  return result;
}

void compare_campaigns(const std::vector<fs::path>& folders, const fs::path& out) {
  check_run_folder(out);
  std::vector<ParetoPoint> points;
  std::error_code ignored;
  for (const fs::path& folder : folders) {
    if (fs::exists(folder / kBoundFile, ignored)) {
      for (ParetoPoint& point : read_bounds(folder)) points.push_back(std::move(point));
    } else {
      points.push_back(read_pareto_point(folder));
    }
  }
  const Figure figure = pareto_figure(points);
  const Table rows = pareto_table(points);
  const PageHead head{
      .title = "Violation against held temperature",
      .kicker = "comparison",
      .line = fmt::format("{} campaigns", folders.size()),
      .notice = "Virtual eyes: the result covers only the variation of the random inputs."};
  fs::create_directories(out);
  write_file((out / "compare.svg").string(), figure_svg(figure, SvgKind::kStandAlone));
  write_file((out / "compare.csv").string(), figure_csv(figure));
  write_file((out / "tables.md").string(), as_markdown(rows));
  write_file((out / "index.html").string(),
             page(head, section("Violation against held temperature", stack({figure})) +
                            section("Campaigns", table(rows, "Campaigns"))));
}

}  // namespace photocoag
