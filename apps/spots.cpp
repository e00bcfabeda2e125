// `photocoag spots`: random spots under the nominal and the robust controller, side by side.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/percentile.hpp"
#include "photocoag/population/spots.hpp"
#include "photocoag/run/model_cache.hpp"
#include "photocoag/run/tissue_margin.hpp"
#include "progress.hpp"

namespace photocoag {
namespace {

struct SpotsOptions : CommonOptions {
  std::size_t count = 1000;
  SpotRange range;
  std::string csv;          ///< file for one row per spot; may be empty
  bool corners = false;     ///< all extremes of the declared set instead of random spots
  bool this_eye = false;    ///< the eye of [plant.tissue] instead
  std::size_t survey = 60;  ///< treatments of every corner; the worst get count
};

std::vector<double> column(const std::vector<SpotOutcome>& spots, double SpotOutcome::*member) {
  std::vector<double> values;
  for (const SpotOutcome& spot : spots) values.push_back(spot.*member);
  return values;
}

void print_row(const std::string& name, const std::vector<SpotOutcome>& spots) {
  std::size_t violating = 0;
  std::vector<double> alpha_errors;
  for (const SpotOutcome& spot : spots) {
    violating += spot.violations > 0 ? 1 : 0;
    alpha_errors.push_back(std::abs(spot.absorption_error));
  }
  const auto peaks = column(spots, &SpotOutcome::peak_max);
  const auto times = column(spots, &SpotOutcome::time_to_95_percent);
  const auto held = column(spots, &SpotOutcome::held_mean);
  const auto rms = column(spots, &SpotOutcome::rms_error);
  print("{:<22}{:>6}{:>9.2f}{:>9.2f}{:>8.1f}{:>8.1f}{:>9.2f}{:>9.2f}{:>8.2f}{:>8.2f}{:>9.1f}\n",
        name, violating, percentile(peaks, 0.99), percentile(peaks, 1.0),
        1e3 * percentile(times, 0.5), 1e3 * percentile(times, 0.99), percentile(held, 0.01),
        percentile(held, 0.99), percentile(rms, 0.5), percentile(rms, 0.99),
        100.0 * percentile(alpha_errors, 0.99));
}

std::string csv_rows(const std::string& name, const std::vector<SpotOutcome>& spots) {
  std::string text;
  for (std::size_t i = 0; i < spots.size(); ++i) {
    const SpotOutcome& s = spots[i];
    text +=
        fmt::format("{},{},{},{},{},{},{},{},{}\n", name, i + 1, s.alpha, s.peak_max, s.violations,
                    s.time_to_95_percent, s.held_mean, s.rms_error, s.absorption_error);
  }
  return text;
}

// Accepted violations of a corner: one treatment in 750, at least two.
std::size_t accepted(std::size_t treatments) { return std::max<std::size_t>(2, treatments / 750); }

// Prints the corners with most violations, and the verdict.
int print_corners(const CornerEffort& effort, std::vector<CornerOutcome> corners) {
  constexpr std::size_t kShown = 6;
  std::size_t treatments = 0;
  std::size_t over = 0;
  std::size_t failed = 0;
  double held = 0.0;
  for (const CornerOutcome& corner : corners) {
    treatments += corner.treatments;
    over += corner.over;
    failed += corner.over > accepted(corner.treatments) ? 1 : 0;
    held += corner.held_mean / static_cast<double>(corners.size());
  }
  std::stable_sort(corners.begin(), corners.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.over, a.treatments, a.peak_max) >
           std::tuple(b.over, b.treatments, b.peak_max);
  });
  if (corners.size() > 1) {
    print(
        "{} corners with {} treatments each, the {} worst with {}: {} of {} over the limit, held "
        "{:.2f} K in the mean\n",
        corners.size(), std::min(effort.survey, effort.count),
        std::min(effort.worst, corners.size()), effort.count, over, treatments, held);
  }
  for (std::size_t i = 0; i < std::min(kShown, corners.size()); ++i) {
    const CornerOutcome& corner = corners[i];
    print("  {:<10} {:3} of {:4} over, highest {:.2f} K (alpha {:.3g}), held {:.2f} K\n",
          corner.name.empty() ? "configured" : corner.name, corner.over, corner.treatments,
          corner.peak_max, corner.peak_max_alpha, corner.held_mean);
  }
  print("{}: {} corners with more than {} of {} over the limit\n",
        failed == 0 ? "passed" : "FAILED", failed, accepted(effort.count), effort.count);
  return failed == 0 ? 0 : 1;
}

int spots_command(const SpotsOptions& options) {
  if (!(options.range.alpha_low <= options.range.alpha_high)) {
    throw Error(
        ErrorParts{.where = "--alpha-high",
                   .found = fmt::format("{}", options.range.alpha_high),
                   .accepted = fmt::format("at least --alpha-low, {}", options.range.alpha_low)});
  }
  Config nominal = configured(Use::kSpots, options.config, options.set);
  nominal.control.robust = Robustness::kNone;
  Config robust = nominal;
  robust.control.robust = Robustness::kCertified;
  ModelStore models(nominal, !options.no_cache, progress_bar("reducing"));
  const ReducedModel& model = models.reduced();
  clear_progress();
  print("photocoag {}: {}\n", version(), kResearchNotice);
  const double limit = nominal.control.peak_max;
  print(
      "{} spots, alpha {:g} to {:g}, full-order eyes, {:g} ms, N = {}, noise {:g} K, limit {:g} "
      "K\n",
      options.count, options.range.alpha_low, options.range.alpha_high,
      nominal.control.period * 1e3, nominal.control.horizon, nominal.plant.noise, limit);
  robust = controller_config(robust, model);
  if (nominal.uncertainty.declared()) {
    print(
        "tissue off by up to {:g} / {:g} / {:g} % (spot radius / thicknesses / absorption): "
        "robust aims at {:.2f} K, limit {:.2f} K\n",
        100 * nominal.uncertainty.spot_radius, 100 * nominal.uncertainty.thickness,
        100 * nominal.uncertainty.absorption, robust.control.peak_reference,
        robust.control.peak_max);
  }
  if (options.corners || options.this_eye) {
    CornerEffort effort{.survey = options.survey, .count = options.count};
    if (options.this_eye) robust.uncertainty = {};
    return print_corners(
        effort, treat_corners(robust, model, options.range, limit, effort, progress_bar("robust")));
  }
  print("{:<22}{:>6}{:>18}{:>16}{:>18}{:>16}{:>9}\n", "", "spots", "highest peak K", "to 95 % ms",
        "held K", "RMS error K", "alpha %");
  print("{:<22}{:>6}{:>9}{:>9}{:>8}{:>8}{:>9}{:>9}{:>8}{:>8}{:>9}\n", "controller", "over", "99 %",
        "max", "median", "99 %", "1 %", "99 %", "median", "99 %", "99 %");
  std::string csv =
      "controller,seed,absorption_factor,peak_true_max_K,violations,time_to_95_percent_s,held_mean_"
      "K,"
      "rms_error_K,absorption_error\n";
  for (const auto& [name, config] : {std::pair<std::string, const Config*>("nominal", &nominal),
                                     std::pair<std::string, const Config*>("robust", &robust)}) {
    const auto spots =
        treat_spots(*config, model, options.range, limit, options.count, progress_bar(name));
    clear_progress();
    print_row(name, spots);
    csv += csv_rows(name, spots);
  }
  if (!options.csv.empty()) write_file(options.csv, csv);
  return 0;
}

const Command kSpots(
    "spots", "treat many random spots with the nominal and the robust controller", spots_command,
    [](CommandLine& command, SpotsOptions& options) {
      add_common(command, options);
      command.add_option("--count", options.count, "spots; seeds 1 to count")
          .check(whole_number_from(1, 1000000))
          .type_name("n");
      command.add_option("--alpha-low", options.range.alpha_low, "smallest absorption factor")
          .check(number_from(0.05, 5.0))
          .type_name("a");
      command.add_option("--alpha-high", options.range.alpha_high, "largest")
          .check(number_from(0.05, 5.0))
          .type_name("a");
      command.add_option("--csv", options.csv, "one row per spot and controller").type_name("FILE");
      const CommandOption corners =
          command.add_flag("--corners", options.corners,
                           "the robust controller at every combination of the declared extremes; "
                           "the worst six are treated --count times; exit code 1 if one of them "
                           "exceeds the limit more than twice and in more than 1 of 750");
      command.add_option("--survey", options.survey, "treatments of every corner")
          .check(whole_number_from(2, 1000000))
          .type_name("n")
          .needs(corners);
      command
          .add_flag("--this-eye", options.this_eye,
                    "only the robust controller on the eye of [plant.tissue], which the controller "
                    "does not know")
          .excludes(corners);
      command.footer(footer(
          "  photocoag spots\n"
          "  photocoag spots --set control.period_ms=4 --set run.duration_ms=400\n"
          "  photocoag spots --set uncertainty.spot_radius_relative=0.1 --set "
          "uncertainty.thickness_relative=0.1 --set uncertainty.absorption_relative=0.1\n"
          "  photocoag spots --corners --count 1500 --set uncertainty.thickness_relative=0.1\n"
          "  photocoag spots --this-eye --set uncertainty.spot_radius_relative=0.1 --set "
          "plant.tissue.spot_radius_um=90\n"
          "The quantities of [uncertainty] are random too; the robust controller knows their "
          "ranges."));
    });

}  // namespace

}  // namespace photocoag
