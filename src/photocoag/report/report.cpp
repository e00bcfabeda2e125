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
  const auto [config, log, summary] = read_run_files(run_folder);
  std::optional<Figure> field;
  if (const std::string file = name("field.vtr"); std::filesystem::exists(file))
    field = field_figure(from_vtr(read_file(file, kMostRunFileBytes), file));

  std::string folder = run_folder.lexically_normal().string();
  while (folder.size() > 1 && folder.ends_with('/')) folder.pop_back();
  write_file(name("report.html"), report_page(log, summary, config, parts_of(log, summary, config),
                                              field, timing_figures(summary.histograms), folder));
}

}  // namespace photocoag
