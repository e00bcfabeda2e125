// `photocoag information`: what limits the treatment of differing eyes, as table, CSV and figure.
#include <fmt/format.h>

#include <filesystem>
#include <iterator>
#include <optional>
#include <string_view>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "doubling_cycles.hpp"
#include "options.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/page/figure.hpp"
#include "photocoag/population/information.hpp"
#include "photocoag/run/claimed_folder.hpp"
#include "photocoag/run/model_cache.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

struct InformationOptions : CommonOptions {
  int eyes = 100;
  std::string out;  ///< folder, new or empty; empty: the table alone
};

namespace fs = std::filesystem;

std::string label(const InformationCase& one) {
  return one.known.empty() ? "as declared" : one.known + " known";
}

void print_tables(const Information& all) {
  const InformationCase& declared = all.cases.front();
  print("{:>10}{:>22}{:>22}\n", "time, ms", "stated deviation, K", "error of the peak, K");
  for (const std::size_t k : doubling_cycles(declared.peak_sigma.size())) {
    print("{:>10g}{:>22.2f}{:>22.2f}\n", static_cast<double>(k) * all.period * 1e3,
          declared.peak_sigma[k - 1], declared.peak_error[k - 1]);
  }
  // Share of the variance that vanishes if the quantity is known.
  const double variance = declared.peak_sigma.back() * declared.peak_sigma.back();
  print("\n{:<36}{:>14}{:>12}{:>12}\n", "known exactly", "deviation, K", "share, %", "held, K");
  for (const InformationCase& one : all.cases) {
    const double left = one.peak_sigma.back() * one.peak_sigma.back();
    const std::string share =
        one.known.empty() ? "" : fmt::format("{:.0f}", 100.0 * (1.0 - left / variance));
    print("{:<36}{:>14.2f}{:>12}{:>+12.2f}\n", one.known.empty() ? "nothing" : one.known,
          one.peak_sigma.back(), share, one.held);
  }
}

std::string csv(const Information& all) {
  std::string text = "known,time_s,peak_sigma_K,peak_error_K\n";
  for (const InformationCase& one : all.cases) {
    for (std::size_t k = 0; k < one.peak_sigma.size(); ++k) {
      fmt::format_to(std::back_inserter(text), "{},{},{},{}\n", one.known,
                     static_cast<double>(k + 1) * all.period, one.peak_sigma[k], one.peak_error[k]);
    }
  }
  return text;
}

Figure figure(const Information& all) {
  Figure drawing{
      .description =
          "Standard deviation of the peak, given all samples so far, over "
          "time: as declared, and with one quantity known",
      .x_label = "time in ms",
      .x_min = 0.0,
      .x_max = static_cast<double>(all.cases.front().peak_sigma.size()) * all.period * 1e3};
  Panel panel{.title = "Standard deviation of the peak at the reference in K", .y_min = 0.0};
  const Ink inks[] = {Ink::kSeries1, Ink::kSeries2, Ink::kSeries3};
  for (std::size_t i = 0; i < all.cases.size(); ++i) {
    const InformationCase& one = all.cases[i];
    Series series{.legend = label(one),
                  .ink = inks[i % 3],
                  .dash = i / 3 % 2 == 0 ? Dash::kSolid : Dash::kDashed};
    if (i == 0) series.width = 3.0;
    for (std::size_t k = 0; k < one.peak_sigma.size(); ++k) {
      series.x.push_back(static_cast<double>(k + 1) * all.period * 1e3);
      series.y.push_back(one.peak_sigma[k]);
    }
    panel.series.push_back(std::move(series));
  }
  drawing.panels.push_back(std::move(panel));
  return drawing;
}

int information(const InformationOptions& options) {
  const Config config = configured(Use::kSimulate, options.config, options.set);
  std::optional<ClaimedFolder> claimed;  // before the work
  if (!options.out.empty()) claimed.emplace(options.out);
  ModelStore models(config, !options.no_cache, progress_bar("fitting"));
  const Information all =
      information_of(config, models.reduced(), static_cast<std::size_t>(options.eyes));
  print("photocoag {}: {}\n", version(), kResearchNotice);
  print("{} eyes of the prior in closed loop, period {:g} ms; peak scaled to {:g} K\n\n", all.eyes,
        all.period * 1e3, config.control.peak_reference);
  print_tables(all);
  if (options.out.empty()) return 0;
  write_file((fs::path(options.out) / "information.csv").string(), csv(all));
  write_file((fs::path(options.out) / "information.svg").string(),
             figure_svg(figure(all), SvgKind::kStandAlone));
  say("written   {0}/information.csv, {0}/information.svg\n", options.out);
  return 0;
}

const Command kInformation(
    "information",
    "how accurately the peak can be known in eyes of [[prior]], and how much knowing each quantity "
    "would improve it",
    information, [](CommandLine& command, InformationOptions& options) {
      add_common(command, options);
      add_cache(command, options);
      command.add_option("--eyes", options.eyes, "treatments per row")
          .check(whole_number_from(1, 100'000))
          .show_default();
      command.add_option("--out", options.out, "folder for CSV and figure; may be left out")
          .type_name("DIR");
      command.footer(
          footer("  photocoag information --config configs/uncertain-eye.toml\n"
                 "  photocoag information --config configs/uncertain-eye.toml --eyes 1000 --out "
                 "runs/information"));
    });

}  // namespace

}  // namespace photocoag
