#include "photocoag/report/report.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "photocoag/core/error.hpp"
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

struct Size {
  double width, panel_height;
  std::size_t max_points;
};
constexpr Size kWide = {520.0, 250.0, 2000};
constexpr Size kNarrow = {310.0, 228.0, 1000};
constexpr double kHistogramHeight = 200.0;

struct Drawings {
  std::vector<FigureColumn> parts;  // of the run
  FigureColumn histograms;
};

// Every part of the run, and where its time went, in both sizes, with one run of gnuplot.
Drawings draw_all(const RunLog& log, const RunSummary& summary, const RunConfig& config,
                  const PlotOptions& options) {
  std::vector<std::pair<std::string, double>> parts;
  if (!log.empty()) {
    const double end_ms = 1e3 * log.time_s.back();
    parts.emplace_back(fmt::format("Whole run, {:g} ms", end_ms), end_ms);
    if (end_ms > kZoomFromMs) parts.emplace_back(fmt::format("First {:g} ms", kZoomMs), kZoomMs);
  }
  std::vector<Figure> figures;
  std::vector<std::size_t> counts;  // of each size of each part, the histograms last
  const auto add = [&](std::vector<Figure> more) {
    counts.push_back(more.size());
    figures.insert(figures.end(), std::make_move_iterator(more.begin()),
                   std::make_move_iterator(more.end()));
  };
  for (const auto& part : parts)
    for (const Size& size : {kWide, kNarrow})
      add(run_figures(log, summary, config,
                      {.from_ms = 0.0,
                       .to_ms = part.second,
                       .width = size.width,
                       .panel_height = size.panel_height,
                       .max_points = size.max_points}));
  for (const Size& size : {kWide, kNarrow})
    add(timing_figures(summary.histograms, size.width, kHistogramHeight));

  const std::vector<std::string> drawn = render_figures(figures, SvgKind::kInline, options);
  auto next = drawn.begin();
  auto count = counts.begin();
  const auto take = [&] {
    const auto begin = next;
    next += static_cast<std::ptrdiff_t>(*count++);
    return std::vector<std::string>(begin, next);
  };
  const auto column = [&](const std::string& heading) {
    FigureColumn both{.heading = heading, .wide = take(), .narrow = {}};
    both.narrow = take();
    return both;
  };
  Drawings drawings;
  for (const auto& part : parts) drawings.parts.push_back(column(part.first));
  drawings.histograms = column("");
  return drawings;
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
  const Drawings drawings = draw_all(log, summary, config, options);
  FieldPicture field;
  if (std::filesystem::exists(run_folder / "field.vtr")) {
    const TemperatureField cells =
        from_vtr(read_file(name("field.vtr"), kMostBytes), name("field.vtr"));
    field = {field_svg(cells, {.width = kWide.width}), field_svg(cells, {.width = kNarrow.width})};
  }
  write_file(name("report.html"),
             report_page(log, summary, config, drawings.parts, field, drawings.histograms, folder));
}

}  // namespace photocoag
