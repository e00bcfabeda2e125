#include "photocoag/report/run_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>

#include "photocoag/core/csv.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"

namespace photocoag {
namespace {

enum class Need { kFinite, kNumber, kMayBeEmpty };

struct ColumnRule {
  std::string_view name;
  std::vector<double> RunLog::*values;
  Need need;
};

constexpr std::array<ColumnRule, 15> kColumns = {{
    {"cycle", &RunLog::cycle, Need::kFinite},
    {"time_s", &RunLog::time_s, Need::kFinite},
    {"power_W", &RunLog::power_W, Need::kFinite},
    {"volume_true_K", &RunLog::volume_true_K, Need::kMayBeEmpty},
    {"volume_measured_K", &RunLog::volume_measured_K, Need::kMayBeEmpty},
    {"volume_estimate_K", &RunLog::volume_estimate_K, Need::kNumber},
    {"peak_true_K", &RunLog::peak_true_K, Need::kMayBeEmpty},
    {"peak_estimate_K", &RunLog::peak_estimate_K, Need::kNumber},
    {"peak_sigma_K", &RunLog::peak_sigma_K, Need::kMayBeEmpty},
    {"absorption_estimate", &RunLog::absorption_estimate, Need::kNumber},
    {"absorption_sigma", &RunLog::absorption_sigma, Need::kNumber},
    {"choroid_estimate", &RunLog::choroid_estimate, Need::kMayBeEmpty},
    {"choroid_sigma", &RunLog::choroid_sigma, Need::kMayBeEmpty},
    {"power_reference_W", &RunLog::power_reference_W, Need::kNumber},
    {"solver_iterations", &RunLog::solver_iterations, Need::kNumber},
}};
constexpr std::string_view kStatusColumn = "solver_status";

struct Place {
  const std::string& file;
  std::size_t line;
};

[[noreturn]] void fail(const Place& place, std::string_view column, std::string_view found,
                       std::string_view accepted) {
  throw Error({.where = fmt::format("{}:{}", place.file, place.line),
               .key = fmt::format("column {}", column),
               .problem = {},
               .found = std::string(found),
               .accepted = std::string(accepted)});
}

double number(std::string_view cell, const ColumnRule& rule, const Place& place) {
  if (cell.empty()) {
    if (rule.need == Need::kMayBeEmpty) return std::numeric_limits<double>::quiet_NaN();
    fail(place, rule.name, "nothing", "a number");
  }
  double value = 0.0;
  const auto [end, problem] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (problem != std::errc() || end != cell.data() + cell.size())
    fail(place, rule.name, fmt::format("\"{}\"", cell), "a number");
  if (rule.need == Need::kFinite && !std::isfinite(value))
    fail(place, rule.name, cell, "a finite number");
  return value;
}

// Where each rule's column is in the file; npos: not there (allowed for what may be empty).
struct Header {
  std::array<std::size_t, kColumns.size()> at{};
  std::size_t status = 0;
  std::size_t width = 0;
};

Header read_header(const std::vector<std::string_view>& names, const std::string& where) {
  const auto find = [&](std::string_view name, bool required) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
    if (required)
      fail({where, 1}, name, "no such column", "a header that names it: cycle,time_s,power_W,…");
    return std::string_view::npos;
  };
  Header header;
  header.width = names.size();
  for (std::size_t k = 0; k < kColumns.size(); ++k)
    header.at[k] = find(kColumns[k].name, kColumns[k].need != Need::kMayBeEmpty);
  header.status = find(kStatusColumn, true);
  return header;
}

}  // namespace

bool RunLog::has_truth() const noexcept {
  return std::any_of(peak_true_K.begin(), peak_true_K.end(),
                     [](double value) { return std::isfinite(value); });
}

double RunLog::energy_J() const noexcept {
  if (empty()) return 0.0;
  return std::accumulate(power_W.begin(), power_W.end(), 0.0) * period_s();
}

RunLog parse_run_log(std::string_view text, const std::string& where) {
  CsvReader rows(std::string(text), where);
  if (!rows.next())
    throw Error({.where = where + ":1", .problem = "the file is empty", .accepted = "a header"});
  const Header header = read_header(rows.cells(), where);
  RunLog log;
  while (rows.next()) {
    const Place place{where, rows.line()};
    const std::vector<std::string_view>& cells = rows.cells();
    if (cells.size() != header.width)
      throw Error({.where = rows.place(),
                   .problem = "the row does not match the header",
                   .found = fmt::format("{} columns", cells.size()),
                   .accepted = fmt::format("{} columns", header.width)});
    for (std::size_t k = 0; k < kColumns.size(); ++k) {
      const std::size_t at = header.at[k];
      (log.*kColumns[k].values)
          .push_back(number(at < cells.size() ? cells[at] : "", kColumns[k], place));
    }
    log.solver_status.emplace_back(cells[header.status]);
    const std::size_t count = log.time_s.size();
    const double before = count > 1 ? log.time_s[count - 2] : 0.0;
    if (!(log.time_s.back() > before))
      fail(place, "time_s", fmt::format("{}", log.time_s.back()), fmt::format("above {}", before));
  }
  return log;
}

RunFiles read_run_files(const std::filesystem::path& folder) {
  const auto parsed = [&folder](auto parse, const char* file) {
    const std::string name = (folder / file).string();
    return parse(read_file(name, kMostRunFileBytes), name);
  };
  return {.config = parsed(parse_run_config, "config.toml"),
          .log = parsed(parse_run_log, "run.csv"),
          .summary = parsed(parse_run_summary, "summary.json")};
}

}  // namespace photocoag
