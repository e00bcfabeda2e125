// Role: tool; the four panels of a run folder as one SVG file with its own colours (light and
// dark). Made with it: docs/figures/treatment.svg (the commands are in CONTRIBUTING.md, "The
// documents' figures"). Uses the same drawing as report.html. Units: as there.
#include <fmt/format.h>

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/page/figure.hpp"
#include "photocoag/report/run_figures.hpp"
#include "photocoag/report/run_log.hpp"

namespace {

using namespace photocoag;

constexpr std::size_t kMaxBytes = 100'000'000;

std::string draw(const std::filesystem::path& folder, double to_ms) {
  const auto name = [&folder](const char* file) { return (folder / file).string(); };
  const RunConfig config =
      parse_run_config(read_file(name("config.toml"), kMaxBytes), name("config.toml"));
  const RunLog log = parse_run_log(read_file(name("run.csv"), kMaxBytes), name("run.csv"));
  const RunSummary summary =
      parse_run_summary(read_file(name("summary.json"), kMaxBytes), name("summary.json"));
  if (log.empty()) throw Error(ErrorParts{.where = name("run.csv"), .problem = "no cycles"});

  std::vector<Figure> parts = run_figures(log, summary, config, {.from_ms = 0.0, .to_ms = to_ms});
  Figure figure = std::move(parts.front());
  for (std::size_t i = 1; i < parts.size(); ++i) {
    figure.description += " " + parts[i].description;
    figure.panels.push_back(std::move(parts[i].panels.front()));
  }
  figure.width = 760.0;
  figure.panel_height = 185.0;
  return figure_svg(figure, SvgKind::kStandAlone);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: photocoag_figure RUN_FOLDER TO_MS OUT.svg\n");
    return 2;
  }
  try {
    char* end = nullptr;
    const double to_ms = std::strtod(argv[2], &end);
    if (end == argv[2] || *end != '\0' || !(to_ms > 0.0)) {
      throw Error(
          ErrorParts{.where = "TO_MS", .found = argv[2], .accepted = "a time in ms above 0"});
    }
    write_file(argv[3], draw(argv[1], to_ms));
  } catch (const std::exception& error) {
    fmt::print(stderr, "photocoag_figure: {}\n", error.what());
    return 2;
  }
  return 0;
}
