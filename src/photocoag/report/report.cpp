#include "photocoag/report/report.hpp"

#include <fmt/format.h>

#include <optional>
#include <string_view>

#include "photocoag/core/files.hpp"
#include "photocoag/core/vtk.hpp"
#include "photocoag/report/field_figure.hpp"
#include "photocoag/report/page.hpp"
#include "photocoag/report/run_figures.hpp"
#include "photocoag/report/run_log.hpp"
#include "photocoag/report/timing_figures.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kMostBytes = 500'000'000;  // of a file of a run folder

constexpr double kZoomMs = 20.0;      // the heating phase
constexpr double kZoomFromMs = 40.0;  // runs longer than this get a zoom

// The whole run, and its beginning if it is long.
std::vector<FigureColumn> parts_of(const RunLog& log, const RunSummary& summary,
                                   const RunConfig& config) {
  if (log.empty()) return {};
  const auto part = [&](std::string_view name, double to_ms) {
    return FigureColumn{fmt::format("{} {:g} ms", name, to_ms),
                        run_figures(log, summary, config, {.from_ms = 0.0, .to_ms = to_ms})};
  };
  const double end_ms = 1e3 * log.time_s.back();
  std::vector<FigureColumn> parts = {part("Whole run,", end_ms)};
  if (end_ms > kZoomFromMs) parts.push_back(part("First", kZoomMs));
  return parts;
}

}  // namespace

void write_report(const std::filesystem::path& run_folder) {
  const auto name = [&run_folder](const char* file) { return (run_folder / file).string(); };
  const auto content = [&](const char* file) { return read_file(name(file), kMostBytes); };
  const RunConfig config = parse_run_config(content("config.toml"), name("config.toml"));
  const RunLog log = parse_run_log(content("run.csv"), name("run.csv"));
  const RunSummary summary = parse_run_summary(content("summary.json"), name("summary.json"));
  std::optional<Figure> field;
  if (std::filesystem::exists(run_folder / "field.vtr"))
    field = field_figure(from_vtr(content("field.vtr"), name("field.vtr")));

  std::string folder = run_folder.lexically_normal().string();
  while (folder.size() > 1 && folder.ends_with('/')) folder.pop_back();
  write_file(name("report.html"), report_page(log, summary, config, parts_of(log, summary, config),
                                              field, timing_figures(summary.histograms), folder));
}

}  // namespace photocoag
