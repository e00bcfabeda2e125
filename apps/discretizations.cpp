// `photocoag discretizations`: errors of implicit Euler and TR-BDF2, as table, CSV and figure.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/page/figure.hpp"
#include "photocoag/run/claimed_folder.hpp"
#include "photocoag/run/discretizations.hpp"

namespace photocoag {
namespace {

struct DiscretizationsOptions : CommonOptions {
  std::string out;  ///< folder for CSV and figure; may be empty
};

namespace fs = std::filesystem;

constexpr std::size_t kSteps = 100;
constexpr std::size_t kDrawnSteps = 10;

std::string_view name(Discretization how) {
  return how == Discretization::kImplicitEuler ? "implicit Euler" : "TR-BDF2";
}

void print_table(const std::vector<DiscretizationErrors>& all) {
  print("peak in K for 1 W       steps{:>10}{:>16}{:>9}{:>12}{:>9}\n", "exact", "implicit Euler",
        "%", "TR-BDF2", "%");
  for (std::size_t i = 0; i + 1 < all.size(); i += 2) {
    for (const std::size_t steps : {1U, 2U, 3U, 4U, 5U, 10U, 20U, 50U, 100U}) {
      print("{:<20}{:>9}{:>10.2f}", fmt::format("{:g} ms", all[i].period * 1e3), steps,
            all[i].exact[steps - 1].peak);
      print("{:>16.2f}{:>9.2f}{:>12.2f}{:>9.2f}\n", all[i].stepped[steps - 1].peak,
            100.0 * all[i].peak(steps), all[i + 1].stepped[steps - 1].peak,
            100.0 * all[i + 1].peak(steps));
    }
  }
}

std::string csv(const std::vector<DiscretizationErrors>& all) {
  std::string text =
      "period_ms,discretization,steps,time_s,exact_peak_K,peak_K,peak_error_relative,"
      "exact_volume_K,volume_K,volume_error_relative\n";
  for (const DiscretizationErrors& scheme : all) {
    for (std::size_t steps = 1; steps <= scheme.exact.size(); ++steps) {
      const Outputs& exact = scheme.exact[steps - 1];
      const Outputs& stepped = scheme.stepped[steps - 1];
      fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{}\n",
                     scheme.period * 1e3, to_string(scheme.discretization), steps,
                     scheme.period * static_cast<double>(steps), exact.peak, stepped.peak,
                     scheme.peak(steps), exact.volume, stepped.volume, scheme.volume(steps));
    }
  }
  return text;
}

template <typename Value>
Series over_steps(std::string legend, Ink ink, Dash dash, Mark mark, Value value) {
  Series series{.legend = std::move(legend), .ink = ink, .dash = dash, .mark = mark};
  if (mark == Mark::kPoints) series.width = 6.0;
  for (std::size_t steps = 1; steps <= kDrawnSteps; ++steps) {
    series.x.push_back(static_cast<double>(steps));
    series.y.push_back(value(steps));
  }
  return series;
}

Figure figure(const std::vector<DiscretizationErrors>& all) {
  Figure result{.description =
                    "Step response of the peak by the exact hold, implicit Euler and "
                    "TR-BDF2, and the error of the two schemes in per cent",
                .x_label = "control periods since switching on",
                .x_min = 0.0,
                .x_max = static_cast<double>(kDrawnSteps)};
  Panel errors{.title = "Error of the peak in %", .levels = {{.label = "exact"}}};
  for (std::size_t i = 0; i + 1 < all.size(); i += 2) {
    const auto period = fmt::format("{:g} ms", all[i].period * 1e3);
    Panel panel{.title = "Peak temperature rise for 1 W in K, " + period, .y_min = 0.0};
    panel.series.push_back(over_steps("exact", Ink::kSeries1, Dash::kSolid, Mark::kLine,
                                      [&](auto s) { return all[i].exact[s - 1].peak; }));
    for (const std::size_t which : {i, i + 1}) {
      const DiscretizationErrors& scheme = all[which];
      const bool euler = which == i;
      const Ink ink = euler ? Ink::kSeries2 : Ink::kSeries3;
      panel.series.push_back(over_steps(std::string(name(scheme.discretization)), ink, Dash::kSolid,
                                        Mark::kPoints,
                                        [&](auto s) { return scheme.stepped[s - 1].peak; }));
      errors.series.push_back(over_steps(fmt::format("{}, {}", name(scheme.discretization), period),
                                         ink, i == 0 ? Dash::kSolid : Dash::kDashed, Mark::kLine,
                                         [&](auto s) { return 100.0 * scheme.peak(s); }));
    }
    result.panels.push_back(std::move(panel));
  }
  result.panels.push_back(std::move(errors));
  return result;
}

int discretizations(const DiscretizationsOptions& options) {
  const Config config = configured(Use::kSchemeComparison, options.config, options.set);
  std::optional<ClaimedFolder> claimed;  // before the work
  if (!options.out.empty()) claimed.emplace(options.out);
  const double alpha = config.plant.absorption_factor;
  const auto full = std::make_shared<const FullOrderModel>(config.plant.tissue, config.grid);
  const std::vector<DiscretizationErrors> all =
      discretization_errors(full, config.plant.absorption(), {1e-3, 4e-3}, kSteps);
  print("photocoag {}: {}\n", version(), kResearchNotice);
  print("{} states, absorption factor {:g}, constant power from cold tissue\n\n", full->states(),
        alpha);
  print_table(all);
  print(
      "\nAfter the first step the paper's implicit Euler is {:.1f} % {} at 1 ms and {:.1f} % "
      "{} at 4 ms.\n",
      100.0 * std::abs(all[0].peak(1)), all[0].peak(1) < 0.0 ? "low" : "high",
      100.0 * std::abs(all[2].peak(1)), all[2].peak(1) < 0.0 ? "low" : "high");
  if (options.out.empty()) return 0;
  const Figure drawing = figure(all);
  write_file((fs::path(options.out) / "discretizations.csv").string(), csv(all));
  write_file((fs::path(options.out) / "discretizations.svg").string(),
             figure_svg(drawing, SvgKind::kStandAlone));
  say("written   {0}/discretizations.csv, {0}/discretizations.svg\n", options.out);
  return 0;
}

const Command kDiscretizations(
    "discretizations",
    "errors of implicit Euler (the paper's) and TR-BDF2 in the first steps, at 1 and at 4 ms",
    discretizations, [](CommandLine& command, DiscretizationsOptions& options) {
      add_common(command, options);
      command.add_option("--out", options.out, "folder for CSV and figure; may be left out")
          .type_name("DIR");
      command.footer(
          footer("  photocoag discretizations --set plant.absorption_factor=0.7363\n"
                 "  photocoag discretizations --out runs/discretizations\n"
                 "The eye is that of [plant]: its absorption_factor and tissue."));
    });

}  // namespace

}  // namespace photocoag
