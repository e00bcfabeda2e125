#include "photocoag/report/report.hpp"

#include <fmt/format.h>

#include <fstream>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/vtk.hpp"
#include "photocoag/report/field_figure.hpp"
#include "photocoag/report/page.hpp"
#include "photocoag/report/run_figures.hpp"
#include "photocoag/report/run_log.hpp"

namespace photocoag {
namespace {

constexpr std::size_t kMostBytes = 500'000'000;  // of a file of a run folder

constexpr double kZoomMs = 20.0;      // the heating phase
constexpr double kZoomFromMs = 40.0;  // runs longer than this get a zoom

struct Size {
  double width, panel_height;
  std::size_t max_points;
};
constexpr Size kWide = {520.0, 250.0, 2000};
constexpr Size kNarrow = {310.0, 228.0, 1000};

// Every part of the run in both sizes, with one run of gnuplot.
std::vector<FigureColumn> draw_columns(const RunLog& log, const RunSummary& summary,
                                       const RunConfig& config, const PlotOptions& options) {
  if (log.empty()) return {};
  const double end_ms = 1e3 * log.time_s.back();
  std::vector<std::pair<std::string, double>> parts = {
      {fmt::format("Whole run, {:g} ms", end_ms), end_ms}};
  if (end_ms > kZoomFromMs) parts.emplace_back(fmt::format("First {:g} ms", kZoomMs), kZoomMs);

  std::vector<Figure> figures;
  for (const auto& part : parts)
    for (const Size& size : {kWide, kNarrow})
      for (Figure& figure : run_figures(log, summary, config,
                                        {.from_ms = 0.0,
                                        .to_ms = part.second,
                                        .width = size.width,
                                        .panel_height = size.panel_height,
                                        .max_points = size.max_points}))
        figures.push_back(std::move(figure));
  const std::vector<std::string> drawn = render_figures(figures, SvgKind::kInline, options);

  const std::size_t each = drawn.size() / (2 * parts.size());
  std::vector<FigureColumn> columns;
  auto next = drawn.begin();
  const auto take = [&next, each] {
    const auto begin = next;
    next += static_cast<std::ptrdiff_t>(each);
    return std::vector<std::string>(begin, next);
  };
  for (const auto& part : parts) {
    FigureColumn column{.heading = part.first, .wide = take(), .narrow = {}};
    column.narrow = take();
    columns.push_back(std::move(column));
  }
  return columns;
}

}  // namespace

void write_report(const std::filesystem::path& run_folder, const PlotOptions& options) {
  const auto name = [&run_folder](const char* file) { return (run_folder / file).string(); };
  const RunConfig config = parse_run_config(read_file(name("config.toml"), kMostBytes), name("config.toml"));
  const RunLog log = parse_run_log(read_file(name("run.csv"), kMostBytes), name("run.csv"));
  const RunSummary summary =
      parse_run_summary(read_file(name("summary.json"), kMostBytes), name("summary.json"));

  std::string folder = run_folder.lexically_normal().string();
  while (folder.size() > 1 && folder.ends_with('/')) folder.pop_back();
  const auto columns = draw_columns(log, summary, config, options);
  FieldPicture field;
  if (std::filesystem::exists(run_folder / "field.vtr")) {
    const TemperatureField cells =
        from_vtr(read_file(name("field.vtr"), kMostBytes), name("field.vtr"));
    field = {field_svg(cells, {.width = kWide.width}), field_svg(cells, {.width = kNarrow.width})};
  }
  write_file(name("report.html"), report_page(log, summary, config, columns, field, folder));
}

}  // namespace photocoag
