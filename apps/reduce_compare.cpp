// `photocoag reduce --compare`: every reduction side by side, as table, CSV and figure.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>

#include "configured.hpp"
#include "console.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/mor/compare.hpp"
#include "photocoag/page/figure.hpp"
#include "photocoag/run/claimed_folder.hpp"
#include "progress.hpp"
#include "reduce.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;

constexpr int kFirstOrder = 2;
constexpr int kLastOrder = 14;

std::string percent(const ComparisonRow& row) {
  if (row.peak == 0.0) return "-";
  return fmt::format("{:.3g}{}", 100.0 * std::max(row.peak, row.volume),
                     row.refused.empty() ? "" : "*");
}

// Rows of one table: a label and the cells in the order of the columns.
void print_rows(const std::vector<ComparisonRow>& rows, std::size_t columns,
                std::string (*label)(const ReductionSettings&)) {
  for (std::size_t first = 0; first + columns <= rows.size(); first += columns) {
    print("{:<20}", label(rows[first].settings));
    for (std::size_t i = first; i < first + columns; ++i) print("{:>9}", percent(rows[i]));
    print("\n");
  }
}

void print_tables(const Comparison& comparison) {
  print("Largest error in % (peak or volume) against the number of states\n{:<20}", "");
  for (int order = kFirstOrder; order <= kLastOrder; ++order) print("{:>9}", order);
  print("\n");
  print_rows(comparison.methods, kLastOrder - kFirstOrder + 1,
             [](const ReductionSettings& s) { return s.name(); });
  if (std::any_of(comparison.methods.begin(), comparison.methods.end(),
                  [](const ComparisonRow& row) { return !row.refused.empty(); })) {
    print("* a controller would refuse this model: verify() in rom/reduced_model.hpp\n");
  }
  print("\n");
  const std::size_t terms = comparison.dependences.size() / kParameterDependenceWords.size();
  print("Largest error in %, POD basis of 14 states, against the number of terms\n{:<20}", "");
  for (std::size_t i = 0; i < terms; ++i) {
    print("{:>9}", comparison.dependences[i].settings.parameter_terms);
  }
  print("\n");
  print_rows(comparison.dependences, terms, [](const ReductionSettings& s) {
    return std::string(to_string(s.parameter_dependence));
  });
}

std::string csv(const Comparison& comparison, double period) {
  std::string text =
      "period_ms,method,refinement,parameter_dependence,terms,order,peak_error_relative,"
      "volume_error_relative,refused\n";
  for (const auto* rows : {&comparison.methods, &comparison.dependences}) {
    for (const ComparisonRow& row : *rows) {
      fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{}\n", period * 1e3,
                     to_string(row.settings.method),
                     row.settings.refined() ? to_string(row.settings.refinement) : "none",
                     to_string(row.settings.dependence()), row.settings.terms(), row.settings.order,
                     row.peak, row.volume, row.refused.empty() ? "no" : "yes");
    }
  }
  return text;
}

Figure figure(const Comparison& comparison, double period) {
  Figure result{.description = "Largest relative error of the reductions against the order",
                .x_label = "order: states of the reduced model",
                .x_min = kFirstOrder,
                .x_max = kLastOrder};
  constexpr std::array kInks{Ink::kSeries1, Ink::kSeries2, Ink::kSeries3,
                             Ink::kSeries4, Ink::kMuted,   Ink::kNeutral};
  constexpr std::array kDashes{Dash::kSolid,      Dash::kDashed, Dash::kDotted,
                               Dash::kDashDotted, Dash::kSolid,  Dash::kSolid};
  for (const bool peak : {true, false}) {
    Panel panel{.title = fmt::format("{} temperature, {} ms: log10 of the largest error in %",
                                     peak ? "Peak" : "Volume", period * 1e3)};
    for (const ComparisonRow& row : comparison.methods) {
      const auto m = static_cast<std::size_t>(row.settings.method) +
                     (row.settings.refined() ? kReductionMethodWords.size() : 0);
      if (panel.series.empty() || panel.series.back().legend != row.settings.name()) {
        panel.series.push_back(
            {.legend = row.settings.name(), .ink = kInks[m], .dash = kDashes[m]});
      }
      const double error = peak ? row.peak : row.volume;
      panel.series.back().x.push_back(row.settings.order);
      panel.series.back().y.push_back(error > 0.0 ? std::log10(100.0 * error) : std::nan(""));
    }
    result.panels.push_back(std::move(panel));
  }
  return result;
}

// The paper: global basis and DEIM were found superior to the Taylor series. Judged at the paper's
// order, at equal numbers of terms and with the linear and quadratic series.
void print_verdict(const Comparison& comparison) {
  constexpr int kOrder = 6;
  int wins = 0;
  for (int order = kFirstOrder; order <= kLastOrder; ++order) {
    wins += comparison.error(ReductionMethod::kPodDeim, order) <
                    comparison.error(ReductionMethod::kTaylor, order)
                ? 1
                : 0;
  }
  const double deim = comparison.error(ReductionMethod::kPodDeim, kOrder);
  const double taylor = comparison.error(ReductionMethod::kTaylor, kOrder);
  print("\nThe paper's statement: global basis and DEIM are superior to the Taylor series.\n");
  print("  {} at order {}, 5 terms each: {:.2f} % against {:.2f} %; better at {} of {} orders\n",
        deim < taylor ? "CONFIRMED" : "NOT CONFIRMED", kOrder, 100.0 * deim, 100.0 * taylor, wins,
        kLastOrder - kFirstOrder + 1);
  print("  parameter dependence alone (POD basis, 14 states):");
  for (const int terms : {2, 3, 4, 5}) {
    print(" {} terms {:.3g} % against {:.3g} %{}", terms,
          100.0 * comparison.error(ParameterDependence::kDeim, terms),
          100.0 * comparison.error(ParameterDependence::kTaylor, terms), terms == 5 ? "\n" : ";");
  }
}

}  // namespace

int compare_reductions(const ReduceOptions& options) {
  const Config config = configured(Use::kCompareReductions, options.config, options.set);
  const bool csv_only = fs::path(options.out).extension() == ".csv";
  std::optional<ClaimedFolder> claimed;  // before the work
  if (!options.out.empty() && !csv_only) claimed.emplace(options.out);
  const double period = config.control.period;
  const auto full = std::make_shared<const FullOrderModel>(config.tissue, config.grid);
  const Comparison comparison =
      compare_reductions(full, period, config.model.discretization, progress_bar("comparing"));
  clear_progress();
  print("photocoag {}: {}\n", version(), kResearchNotice);
  print("{} states, {:g} ms, alpha 0.30 to 1.70, constant and on/off power, 400 ms\n\n",
        full->states(), period * 1e3);
  print_tables(comparison);
  print_verdict(comparison);
  if (options.out.empty()) return 0;
  if (csv_only) {
    write_file(options.out, csv(comparison, period));
    return 0;
  }
  const Figure drawing = figure(comparison, period);
  write_file((fs::path(options.out) / "comparison.csv").string(), csv(comparison, period));
  write_file((fs::path(options.out) / "comparison.svg").string(),
             figure_svg(drawing, SvgKind::kStandAlone));
  say("written   {0}/comparison.csv, {0}/comparison.svg\n", options.out);
  return 0;
}

}  // namespace photocoag
